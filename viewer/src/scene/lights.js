// Soft light from the sky and one sun whose shadows follow what is looked at.
import { DirectionalLight, Group, HemisphereLight } from 'three';

const SHADOW_PIXELS = 1024;
const REACH_M = 4.5;

export class Lights {
  group = new Group();

  constructor(theme, shadows) {
    this.sky = new HemisphereLight();
    this.sun = new DirectionalLight();
    this.sun.position.set(-1.4, 6.5, 2.2);
    this.sun.castShadow = shadows;
    const { shadow } = this.sun;
    shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    shadow.radius = 5;
    shadow.normalBias = 0.02;
    Object.assign(shadow.camera, {
      left: -REACH_M,
      right: REACH_M,
      top: REACH_M,
      bottom: -REACH_M,
      near: 0.5,
      far: 16,
    });
    this.group.add(this.sky, this.sun, this.sun.target);
    this.setTheme(theme);
  }

  setTheme(theme) {
    this.sky.color.copy(theme.sky);
    this.sky.groundColor.copy(theme.below);
    this.sky.intensity = theme.ambient;
    this.sun.intensity = theme.sun;
  }

  follow(centre) {
    this.group.position.set(centre.x, 0, centre.z);
  }
}
