// The inner half of the check: compiles with Tint, draws with three.js.
import * as GL from 'three';
import * as GPU from 'three/webgpu';
import * as TSL from 'three/tsl';

const adapter = await navigator.gpu?.requestAdapter();
const device = await adapter?.requestDevice();

// What Tint says of a WGSL text with an entry point `main`, as lines; nothing where it compiles.
async function tint(code) {
	device.pushErrorScope('validation');
	const module = device.createShaderModule({ code });
	const said = (await module.getCompilationInfo()).messages.map((m) => `${m.type} at line ${m.lineNum}: ${m.message}`);
	await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint: 'main' } }).catch((e) => said.push(e.message));
	const error = await device.popErrorScope();
	if (error && !said.length) said.push(error.message);
	return said;
}

// Draws a node material and reads its first pixel. `body` is a README's code without its imports; it finds `text`, the
// library, `material`, and the inputs that a program would have.
async function webgpu(text, body) {
	const renderer = new GPU.WebGPURenderer();
	await renderer.init();
	if (!renderer.backend.isWebGPUBackend) throw new Error('three.js does not use WebGPU');
	const material = new GPU.NodeMaterial();
	const inputs = { text, material, h: TSL.vec3(0.6, 0, 0.8), texel: TSL.vec3(0.5, 0.5, 0.3), x: TSL.vec3(1, 0, 0), y: TSL.vec3(0, 1, 0) };
	const scope = { ...TSL, ...inputs };
	const used = Object.keys(scope).filter((name) => new RegExp(`\\b${name}\\b`).test(body));
	new Function(...used, body)(...used.map((name) => scope[name]));
	const target = new GPU.RenderTarget(1, 1, { type: GPU.FloatType, depthBuffer: false });
	renderer.setRenderTarget(target);
	new GPU.QuadMesh(material).render(renderer);
	return Array.from((await renderer.readRenderTargetPixelsAsync(target, 0, 0, 1, 1)).slice(0, 4));
}

// Draws a material of WebGLRenderer; `body` puts `kinran`, the library, into `material`. What was drawn calls the library.
function webgl(kinran, body) {
	const renderer = new GL.WebGLRenderer();
	const errors = [];
	renderer.debug.onShaderError = (gl, program, vertex, fragment) => errors.push(gl.getShaderInfoLog(fragment));
	const material = new GL.MeshBasicMaterial();
	new Function('material', 'kinran', body)(material, kinran);
	const library = material.onBeforeCompile;
	material.onBeforeCompile = (shader) => {
		library(shader);
		shader.fragmentShader = shader.fragmentShader.replace('#include <opaque_fragment>',
			'#include <opaque_fragment>\ngl_FragColor = vec4(alpha_from_roughness(0.5), smith_v(0.5, 0.5, 0.3), ggx_d(0.9, 0.5), 1.0);');
	};
	const mesh = new GL.Mesh(new GL.PlaneGeometry(2, 2), material);
	const target = new GL.WebGLRenderTarget(1, 1, { type: GL.FloatType });
	renderer.setRenderTarget(target);
	renderer.render(mesh, new GL.OrthographicCamera(-1, 1, 1, -1, -1, 1));
	const pixel = new Float32Array(4);
	renderer.readRenderTargetPixels(target, 0, 0, 1, 1, pixel);
	if (errors.length) throw new Error(errors.join('\n'));
	return Array.from(pixel);
}

window.check = { device: adapter && `${adapter.info.vendor} ${adapter.info.architecture}`, revision: GPU.REVISION, tint, webgpu, webgl };
