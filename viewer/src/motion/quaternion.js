// Quaternions x, y, z, w and vectors inside flat arrays: `q` at index `i`. Nothing is allocated.

// out[o] = a[i] b[j]: first b, then a. `out` may be one of the others.
export function multiply(out, o, a, i, b, j) {
  const ax = a[i],
    ay = a[i + 1],
    az = a[i + 2],
    aw = a[i + 3];
  const bx = b[j],
    by = b[j + 1],
    bz = b[j + 2],
    bw = b[j + 3];
  out[o] = aw * bx + ax * bw + ay * bz - az * by;
  out[o + 1] = aw * by - ax * bz + ay * bw + az * bx;
  out[o + 2] = aw * bz + ax * by - ay * bx + az * bw;
  out[o + 3] = aw * bw - ax * bx - ay * by - az * bz;
}

// out[o] = the inverse of the unit quaternion q[i].
export function invert(out, o, q, i) {
  out[o] = -q[i];
  out[o + 1] = -q[i + 1];
  out[o + 2] = -q[i + 2];
  out[o + 3] = q[i + 3];
}

// out[o] = v[j] turned by q[i].
export function rotate(out, o, q, i, v, j) {
  const qx = q[i],
    qy = q[i + 1],
    qz = q[i + 2],
    qw = q[i + 3];
  const vx = v[j],
    vy = v[j + 1],
    vz = v[j + 2];
  const tx = 2 * (qy * vz - qz * vy);
  const ty = 2 * (qz * vx - qx * vz);
  const tz = 2 * (qx * vy - qy * vx);
  out[o] = vx + qw * tx + qy * tz - qz * ty;
  out[o + 1] = vy + qw * ty + qz * tx - qx * tz;
  out[o + 2] = vz + qw * tz + qx * ty - qy * tx;
}
