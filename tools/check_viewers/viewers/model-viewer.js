export async function draw(url, side) {
	// Read while it is imported; else it asks a server of Google's.
	window.ModelViewerElement = { ktx2TranscoderLocation: '/npm/three/examples/jsm/libs/basis/' };
	await import('/npm/@google/model-viewer/dist/model-viewer.min.js');
	const Viewer = customElements.get('model-viewer');
	const viewer = new Viewer();
	Object.assign(viewer.style, { width: `${side}px`, height: `${side}px`, backgroundColor: '#000' });
	viewer.setAttribute('camera-orbit', '29deg 73deg auto');
	viewer.setAttribute('interaction-prompt', 'none');
	viewer.setAttribute('environment-image', 'neutral');
	viewer.setAttribute('tone-mapping', 'none');
	viewer.setAttribute('exposure', '0.5');
	// Its own scaling of the picture by the time that a frame takes.
	viewer.setAttribute('min-camera-orbit', 'auto auto auto');
	Viewer.minimumRenderScale = 1;
	const loaded = new Promise((done, failed) => {
		viewer.addEventListener('load', done);
		viewer.addEventListener('error', (event) => failed(new Error(event.detail?.sourceError?.message ?? 'error')));
	});
	viewer.src = url;
	document.getElementById('stage').append(viewer);
	await loaded;
	// It fades in.
	await new Promise((done) => setTimeout(done, 2500));
	await frames(3);
}
