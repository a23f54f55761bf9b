// The renderer, made for what draws: a graphics card, or the processor in its place. There edges are
// not smoothed and shadows are hard, which takes less than half of the time.
import { BasicShadowMap, PCFShadowMap, WebGLRenderer } from 'three';

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software/i;

function drawsInSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return SOFTWARE.test(name);
}

// ?fine in the page's address draws as with a graphics card: for pictures.
export function makeRenderer(canvas) {
  const fine = new URLSearchParams(location.search).has('fine') || !drawsInSoftware();
  const renderer = new WebGLRenderer({ canvas, antialias: fine });
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = fine ? PCFShadowMap : BasicShadowMap;
  renderer.setScissorTest(true);
  return { renderer, fine };
}
