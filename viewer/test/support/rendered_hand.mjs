// A hand for tests of the camera, which nobody has photographed: blended capsules around the bones
// of config/hands/adult.toml, drawn by marching rays, as a film that Chromium takes for a camera.
// By hand: node test/support/rendered_hand.mjs FILE.y4m
import { existsSync, mkdirSync, readFileSync, renameSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const ROOT = join(dirname(fileURLToPath(import.meta.url)), '../../..');
export const FILM = join(ROOT, 'build', 'hand.y4m');
const WIDTH = 320;
const HEIGHT = 240;
export const FRAMES = 20;
const RATE_HZ = 10;
const FINGERS = ['thumb', 'index', 'middle', 'ring', 'little'];
const DEGREE = Math.PI / 180;

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => scaled(a, 1 / Math.hypot(...a));

// Matrices are three rows.
const times = (m, v) => [dot(m[0], v), dot(m[1], v), dot(m[2], v)];
const product = (a, b) =>
  a.map((row) => [0, 1, 2].map((i) => row[0] * b[0][i] + row[1] * b[1][i] + row[2] * b[2][i]));
const transposed = (m) => [0, 1, 2].map((i) => [m[0][i], m[1][i], m[2][i]]);
function rotation(axis, deg) {
  const c = Math.cos(deg * DEGREE);
  const s = Math.sin(deg * DEGREE);
  if (axis === 'x') return [[1, 0, 0], [0, c, -s], [0, s, c]]; // prettier-ignore
  if (axis === 'y') return [[c, 0, s], [0, 1, 0], [-s, 0, c]]; // prettier-ignore
  return [[c, -s, 0], [s, c, 0], [0, 0, 1]]; // prettier-ignore
}
const frameOf = ([x, y, z]) =>
  product(product(rotation('y', y), rotation('x', x)), rotation('z', z));

// The right hand's fingers, in mm and degrees, from the file that posed reads.
export function readShape() {
  const text = readFileSync(join(ROOT, 'config/hands/adult.toml'), 'utf8');
  return FINGERS.map((name) => {
    const part = text.split(`[${name}]`)[1].split(/\n\[[a-z]/)[0];
    const numbers = (key) => {
      const found = new RegExp(`^${key} = \\[([^\\]]*)\\]`, 'm').exec(part);
      return found ? found[1].split(',').map(Number) : null;
    };
    const frame = frameOf(numbers('frame_deg') ?? [0, 0, 0]);
    return {
      base: numbers('base_mm'),
      length: numbers('length_mm'),
      radius: numbers('radius_mm'),
      frame,
      root: numbers('root_deg') ? frameOf(numbers('root_deg')) : frame,
    };
  });
}

// Capsules [from, to, radius from, radius to] in mm, before the camera (x right, y down, z away):
// `angles` are degrees [finger][joint] [flexion, spread, twist] of hand45; `turn` is the camera's view
// of the palm.
function capsulesOf(shape, { angles: hand, turn }) {
  const all = [];
  const view = product(turn, [[1, 0, 0], [0, 0, -1], [0, 1, 0]]); // prettier-ignore
  const put = (from, to, r0, r1) => all.push([times(view, from), times(view, to), r0, r1]);
  const knuckles = [];
  shape.forEach(({ base, length, radius, frame, root }, f) => {
    let at = base;
    let before = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; // prettier-ignore
    for (let j = 0; j < 3; j += 1) {
      const angles = hand[f][j];
      const sign = f > 2 ? -1 : 1; // ring and little spread the other way
      const channel = j === 0 ? root : frame;
      const own = product(
        product(rotation('z', sign * angles[2]), rotation('x', angles[0])),
        rotation('y', sign * angles[1]),
      );
      before = product(before, product(product(channel, own), transposed(channel)));
      const to = add(at, times(before, times(frame, [0, 0, length[j]])));
      put(at, to, radius[j], radius[Math.min(j + 1, 2)] * (j === 2 ? 0.9 : 1));
      at = to;
    }
    if (f > 0) knuckles.push(base);
  });
  for (const [i, knuckle] of knuckles.entries()) {
    put([12 - 9 * i, -2, 4], knuckle, 13, 11);
    if (i > 0) put(knuckles[i - 1], knuckle, 10, 10);
  }
  put([14, -6, 12], shape[0].base, 13, 13);
  put([16, -14, 22], [20, -12, 58], 15, 11); // the balls of thumb and hand: which side is the palm
  put([-22, -9, 22], [-29, -9, 62], 14, 11);
  put([0, -2, 8], [0, -4, -130], 21, 27); // the forearm
  return all;
}

function distanceTo([from, to, r0, r1], p) {
  const along = sub(to, from);
  const t = Math.min(1, Math.max(0, dot(sub(p, from), along) / dot(along, along)));
  return Math.hypot(...sub(sub(p, from), scaled(along, t))) - (r0 + t * (r1 - r0));
}

const BLEND = 5; // mm
function distance(capsules, p) {
  let least = Infinity;
  for (const capsule of capsules) {
    const d = distanceTo(capsule, p);
    const near = Math.max(0, BLEND - Math.abs(d - least)) / BLEND;
    least = Math.min(d, least) - (Number.isFinite(near) ? (near * near * BLEND) / 4 : 0);
  }
  return least;
}

const AWAY = 420; // mm from the camera to the middle of the hand
const FOCAL = 1.05 * WIDTH;
const UP = 70; // the middle of the hand above the wrist
const LIGHT = unit([-0.4, -0.6, -0.75]);

// A circle of the picture that holds all of the capsule.
function shadowOf([from, to, r0, r1]) {
  const [a, b] = [from, to].map(([x, y, z]) => {
    const scale = FOCAL / (z + AWAY);
    return [WIDTH / 2 + scale * x, HEIGHT / 2 + scale * (y + UP), scale];
  });
  const reach = Math.hypot(a[0] - b[0], a[1] - b[1]) / 2;
  const round = 1.15 * Math.max(a[2], b[2]) * (Math.max(r0, r1) + BLEND);
  return { x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2, squared: (reach + round) ** 2 };
}

const wall = (x, y) => {
  const grey = 150 + 40 * (y / HEIGHT) + 12 * Math.sin(x / 37);
  return [grey, grey * 1.02, grey * 1.06];
};

function shade(all, shadows, x, y) {
  const capsules = all.filter(
    (_, i) => (shadows[i].x - x) ** 2 + (shadows[i].y - y) ** 2 < shadows[i].squared,
  );
  if (capsules.length === 0) return wall(x, y);
  const ray = unit([(x - WIDTH / 2) / FOCAL, (y - HEIGHT / 2) / FOCAL, 1]);
  const origin = [0, -UP, -AWAY];
  let far = AWAY - 160;
  for (let i = 0; i < 48 && far < AWAY + 160; i += 1) {
    const p = add(origin, scaled(ray, far));
    const d = distance(capsules, p);
    if (d < 0.3) return lit(capsules, p);
    far += d;
  }
  return wall(x, y);
}

function lit(capsules, p) {
  const e = 0.6;
  const here = distance(capsules, p);
  const normal = unit(
    [0, 1, 2].map((i) => {
      const q = [...p];
      q[i] += e;
      return distance(capsules, q) - here;
    }),
  );
  const open = Math.min(1, distance(capsules, add(p, scaled(normal, 9))) / 9); // not in a fold
  const light = (0.45 + 0.55 * Math.max(0, dot(normal, LIGHT))) * (0.55 + 0.45 * open);
  return [235 * light, 178 * light, 148 * light];
}

// A hand that closes a little and opens, `bend` 0 to 1.
function closing(bend) {
  const finger = (spread) => [0, 1, 2].map((j) => [75 * bend, j === 0 ? spread : 0, 0]);
  const thumb = [0, 1, 2].map((j) => (j === 0 ? [0, 15, 60 * bend] : [45 * bend, 0, 0]));
  return [thumb, finger(9), finger(0), finger(9), finger(14)];
}

export const view = (y_deg, z_deg) => product(rotation('y', y_deg), rotation('z', z_deg));

function poseOf(i) {
  const phase = (2 * Math.PI * i) / FRAMES;
  return {
    angles: closing(0.2 + 0.35 * (0.5 - 0.5 * Math.cos(phase))),
    turn: view(12 * Math.sin(phase), 6 * Math.cos(phase)),
  };
}

export function picture(shape, pose) {
  const capsules = capsulesOf(shape, pose);
  const shadows = capsules.map(shadowOf);
  const rgb = [];
  for (let y = 0; y < HEIGHT; y += 1)
    for (let x = 0; x < WIDTH; x += 1) rgb.push(shade(capsules, shadows, x, y));
  return rgb;
}

// With film noise; 4:2:0, because with 4:4:4 Chromium's camera shows nothing that is found.
function yuv(rgb) {
  const grain = () => 6 * (Math.random() - 0.5);
  const bytes = Buffer.alloc((WIDTH * HEIGHT * 3) / 2);
  const byte = (x) => Math.max(0, Math.min(255, Math.round(x)));
  rgb.forEach(([r, g, b], i) => {
    bytes[i] = byte(0.299 * r + 0.587 * g + 0.114 * b + grain());
  });
  let at = WIDTH * HEIGHT;
  for (const [kr, kg, kb] of [[-0.169, -0.331, 0.5], [0.5, -0.419, -0.081]]) // prettier-ignore
    for (let y = 0; y < HEIGHT; y += 2)
      for (let x = 0; x < WIDTH; x += 2) {
        const [r, g, b] = rgb[y * WIDTH + x];
        bytes[at] = byte(128 + kr * r + kg * g + kb * b);
        at += 1;
      }
  return bytes;
}

// The film's file, made once. `poses`: of its pictures.
export function handFilm(file = FILM, poses = Array.from({ length: FRAMES }, (_, i) => poseOf(i))) {
  if (existsSync(file)) return file;
  const shape = readShape();
  const parts = [`YUV4MPEG2 W${WIDTH} H${HEIGHT} F${RATE_HZ}:1 Ip A1:1 C420jpeg\n`];
  for (const pose of poses) parts.push('FRAME\n', yuv(picture(shape, pose)));
  mkdirSync(dirname(file), { recursive: true });
  writeFileSync(`${file}.part`, Buffer.concat(parts.map((part) => Buffer.from(part))));
  renameSync(`${file}.part`, file);
  return file;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) console.log(handFilm(process.argv[2]));
