import * as pc from '/npm/playcanvas/build/playcanvas.mjs';

export async function draw(url, side) {
	const element = canvas(side);
	const app = new pc.Application(element, { graphicsDeviceOptions: { antialias: true, preserveDrawingBuffer: true } });
	const libs = '/npm/three/examples/jsm/libs/basis/';
	pc.basisInitialize({ glueUrl: `${libs}basis_transcoder.js`, wasmUrl: `${libs}basis_transcoder.wasm`, fallbackUrl: `${libs}basis_transcoder.js` });
	app.setCanvasResolution(pc.RESOLUTION_FIXED, side, side);
	app.start();
	const asset = await new Promise((done, failed) =>
		app.assets.loadFromUrl(url, 'container', (error, asset) => error ? failed(new Error(error)) : done(asset)));
	const model = asset.resource.instantiateRenderEntity();
	app.root.addChild(model);
	const box = new pc.BoundingBox();
	model.findComponents('render').flatMap((render) => render.meshInstances)
		.forEach((mesh, i) => i ? box.add(mesh.aabb) : box.copy(mesh.aabb));
	const distance = distanceOf(box.halfExtents.length());
	const camera = new pc.Entity();
	camera.addComponent('camera', { fov: FIELD_OF_VIEW, nearClip: distance / 100, farClip: distance * 4, clearColor: pc.Color.BLACK });
	camera.setPosition(new pc.Vec3().add2(box.center, new pc.Vec3(...VIEW).normalize().mulScalar(distance)));
	camera.lookAt(box.center);
	app.root.addChild(camera);
	for (const [angles, intensity] of [[[50, -40, 0], 0.5], [[70, 60, 0], 0.3], [[95, 10, 0], 0.25]]) {
		const light = new pc.Entity();
		light.addComponent('light', { type: 'directional', intensity });
		light.setEulerAngles(...angles);
		app.root.addChild(light);
	}
	await frames(20);
}
