export async function draw(url, side) {
	window.CESIUM_BASE_URL = '/npm/cesium/Build/Cesium/';
	await script('/npm/cesium/Build/Cesium/Cesium.js');
	const stage = document.getElementById('stage');
	const widget = new Cesium.CesiumWidget(stage, {
		baseLayer: false, globe: false, skyBox: false, skyAtmosphere: false, scene3DOnly: true, msaaSamples: 4,
		creditContainer: document.createElement('div'), contextOptions: { webgl: { preserveDrawingBuffer: true } },
	});
	const { scene } = widget;
	scene.backgroundColor = Cesium.Color.BLACK;
	const model = await Cesium.Model.fromGltfAsync({ url });
	scene.primitives.add(model);
	scene.light = new Cesium.DirectionalLight({ direction: new Cesium.Cartesian3(-0.6, 0.5, -0.8), intensity: 1.5 });
	await new Promise((done, failed) => {
		model.readyEvent.addEventListener(done);
		model.errorEvent.addEventListener(failed);
	});
	// Models stand on end here: y of the file is z.
	const { center, radius } = model.boundingSphere;
	const [x, y, z] = [VIEW[2], VIEW[0], VIEW[1]];
	const length = Math.hypot(x, y, z);
	const distance = distanceOf(radius);
	scene.camera.frustum.fov = FIELD_OF_VIEW * Math.PI / 180;
	scene.camera.frustum.near = distance / 100;
	const from = new Cesium.Cartesian3(x / length * distance, y / length * distance, z / length * distance);
	const position = Cesium.Cartesian3.add(center, from, new Cesium.Cartesian3());
	const direction = Cesium.Cartesian3.negate(Cesium.Cartesian3.normalize(from, new Cesium.Cartesian3()), new Cesium.Cartesian3());
	const right = Cesium.Cartesian3.normalize(Cesium.Cartesian3.cross(direction, Cesium.Cartesian3.UNIT_Z, new Cesium.Cartesian3()), new Cesium.Cartesian3());
	const up = Cesium.Cartesian3.cross(right, direction, new Cesium.Cartesian3());
	scene.camera.setView({ destination: position, orientation: { direction, up } });
	// Textures arrive in later frames.
	for (let i = 0; i < 60; i++) await frames(1);
	stage.querySelectorAll('canvas').forEach((canvas) => Object.assign(canvas.style, { width: `${side}px`, height: `${side}px` }));
}
