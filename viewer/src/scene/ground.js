// The ground: a grid of 1 m cells that fades with distance, and the shadows of the figures. It
// moves with the view, while its lines stay where they are in the world.
import { Group, Mesh, PlaneGeometry, ShaderMaterial, ShadowMaterial, Vector3 } from 'three';

const SIZE_M = 60;

const VERTEX = `
varying vec2 ground;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  ground = world.xz;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

// A line is as wide as a pixel at least: fwidth() is how far the ground moves from one to the next.
const FRAGMENT = `
uniform vec3 line, strong, centre;
uniform float reach;
varying vec2 ground;
float lines(float cell) {
  vec2 at = ground / cell;
  vec2 wide = max(fwidth(at), 1e-5);
  vec2 near = abs(fract(at - 0.5) - 0.5) / wide;
  vec2 thin = min(vec2(1.0), 0.35 / wide);
  return max((1.0 - min(near.x, 1.0)) * thin.x, (1.0 - min(near.y, 1.0)) * thin.y);
}
void main() {
  float fade = 1.0 - smoothstep(0.25, 1.0, distance(ground, centre.xz) / reach);
  float five = lines(5.0);
  float one = lines(1.0);
  gl_FragColor = vec4(mix(line, strong, five), max(one * 0.85, five) * fade);
  #include <colorspace_fragment>
}`;

export class Ground {
  group = new Group();

  constructor(theme) {
    const plane = new PlaneGeometry(SIZE_M, SIZE_M);
    plane.rotateX(-Math.PI / 2);
    this.grid = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        line: { value: null },
        strong: { value: null },
        centre: { value: new Vector3() },
        reach: { value: 14 },
      },
      transparent: true,
      depthWrite: false,
    });
    this.shadow = new ShadowMaterial({ transparent: true, depthWrite: false });
    const lines = new Mesh(plane, this.grid);
    const shade = new Mesh(plane, this.shadow);
    this.shade = shade;
    shade.receiveShadow = true;
    shade.position.y = 0.001;
    lines.renderOrder = -2;
    shade.renderOrder = -1;
    this.group.add(lines, shade);
    this.setTheme(theme);
  }

  setTheme(theme) {
    this.grid.uniforms.line.value = theme.line;
    this.grid.uniforms.strong.value = theme.strong;
    this.shadow.opacity = theme.shadow;
  }

  // Without shadows their plane would be drawn for nothing.
  setShadows(on) {
    this.shade.visible = on;
  }

  // centre: what the view looks at
  follow(centre) {
    this.group.position.set(centre.x, 0, centre.z);
    this.grid.uniforms.centre.value.copy(centre);
  }
}
