// posed.v1.Skeleton's capsules; none where the lists do not fit.
export function capsulesOf({ parent, capsule_joint = [], capsule_m = [] }) {
  const fits =
    capsule_joint.length <= 4096 &&
    capsule_m.length === 7 * capsule_joint.length &&
    capsule_m.every(Number.isFinite) &&
    capsule_joint.every((joint) => joint < parent.length);
  if (!fits) return [];
  return capsule_joint.map((joint, i) => {
    const at = (k) => capsule_m[7 * i + k];
    return {
      joint,
      from: [at(0), at(1), at(2)],
      to: [at(3), at(4), at(5)],
      radius: at(6),
    };
  });
}
