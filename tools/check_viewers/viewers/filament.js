export async function draw(url, side) {
	await script('/npm/filament/filament.js');
	await new Promise((done) => Filament.init([], done));
	const engine = Filament.Engine.create(canvas(side));
	const scene = engine.createScene();
	const bytes = new Uint8Array(await (await fetch(url)).arrayBuffer());
	const asset = engine.createAssetLoader().createAsset(bytes);
	if (!asset) throw new Error('createAsset returns null');
	await new Promise((done) => asset.loadResources(done, null, new URL(url, location).href.replace(/[^/]*$/, ''), 10));
	scene.addEntities(asset.getEntities());
	const { min, max } = asset.getBoundingBox();
	const centre = min.map((low, i) => (low + max[i]) / 2);
	const distance = distanceOf(Math.hypot(...max.map((high, i) => high - min[i])) / 2);
	for (const [direction, intensity] of [[[0.5, -0.8, -0.6], 40000], [[-0.6, -0.3, -0.7], 20000], [[-0.2, -0.1, -1], 15000]]) {
		const light = Filament.EntityManager.get().create();
		Filament.LightManager.Builder(Filament.LightManager$Type.DIRECTIONAL)
			.color([1, 1, 1]).intensity(intensity).direction(direction).build(engine, light);
		scene.addEntity(light);
	}
	const [swapChain, renderer, view] = [engine.createSwapChain(), engine.createRenderer(), engine.createView()];
	const camera = engine.createCamera(Filament.EntityManager.get().create());
	const length = Math.hypot(...VIEW);
	camera.lookAt(centre.map((c, i) => c + VIEW[i] / length * distance), centre, [0, 1, 0]);
	camera.setProjectionFov(FIELD_OF_VIEW, 1, distance / 100, distance * 4, Filament.Camera$Fov.VERTICAL);
	view.setCamera(camera);
	view.setScene(scene);
	const linear = Filament.ColorGrading.Builder().toneMapping(Filament.ColorGrading$ToneMapping.LINEAR).build(engine);
	view.setColorGrading(linear);
	view.setViewport([0, 0, side, side]);
	renderer.setClearOptions({ clearColor: [0, 0, 0, 1], clear: true });
	for (let i = 0; i < 20; i++) {
		renderer.render(swapChain, view);
		await frames(1);
	}
}
