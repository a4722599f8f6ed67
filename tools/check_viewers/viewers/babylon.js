export async function draw(url, side) {
	await script('/npm/babylonjs/babylon.js');
	await script('/npm/babylonjs-loaders/babylonjs.loaders.min.js');
	const engine = new BABYLON.Engine(canvas(side), true, { preserveDrawingBuffer: true });
	const scene = new BABYLON.Scene(engine);
	scene.useRightHandedSystem = true;
	scene.clearColor = new BABYLON.Color4(0, 0, 0, 1);
	const slash = url.lastIndexOf('/') + 1;
	await BABYLON.SceneLoader.ImportMeshAsync('', url.slice(0, slash), url.slice(slash), scene);
	const { min, max } = scene.getWorldExtends();
	const [centre, radius] = [min.add(max).scale(0.5), max.subtract(min).length() / 2];
	const distance = distanceOf(radius);
	const camera = new BABYLON.FreeCamera('camera', centre.add(new BABYLON.Vector3(...VIEW).normalize().scale(distance)), scene);
	camera.setTarget(centre);
	camera.fov = FIELD_OF_VIEW * Math.PI / 180;
	[camera.minZ, camera.maxZ] = [distance / 100, distance * 4];
	scene.activeCamera = camera;
	for (const [x, y, z, intensity] of [[0.5, -0.8, -0.6, 1], [-0.6, -0.3, -0.7, 0.5], [-0.2, -0.1, -1, 0.4]])
		new BABYLON.DirectionalLight('light', new BABYLON.Vector3(x, y, z), scene).intensity = intensity;
	await scene.whenReadyAsync();
	for (let i = 0; i < 5; i++) {
		scene.render();
		await frames(1);
	}
}
