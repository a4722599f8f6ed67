import * as THREE from 'three';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';

export async function draw(url, side) {
	const renderer = new THREE.WebGLRenderer({ canvas: canvas(side), antialias: true, preserveDrawingBuffer: true });
	renderer.setPixelRatio(1);
	renderer.setSize(side, side, false);
	const ktx2 = new KTX2Loader().setTranscoderPath('/npm/three/examples/jsm/libs/basis/').detectSupport(renderer);
	const { scene: model } = await new GLTFLoader().setKTX2Loader(ktx2).loadAsync(url);
	const scene = new THREE.Scene();
	scene.environment = new THREE.PMREMGenerator(renderer).fromScene(new RoomEnvironment(), 0.04).texture;
	scene.environmentIntensity = 0.3;
	const sphere = new THREE.Box3().setFromObject(model).getBoundingSphere(new THREE.Sphere());
	const distance = distanceOf(sphere.radius);
	const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, distance / 100, distance * 4);
	camera.position.copy(sphere.center).addScaledVector(new THREE.Vector3(...VIEW).normalize(), distance);
	camera.lookAt(sphere.center);
	const light = new THREE.DirectionalLight(0xffffff, 0.6);
	light.position.copy(sphere.center).add(new THREE.Vector3(-0.5, 0.8, 0.6));
	light.target.position.copy(sphere.center);
	scene.add(model, light, light.target);
	for (let i = 0; i < 2; i++) {
		renderer.render(scene, camera);
		await frames(1);
	}
}
