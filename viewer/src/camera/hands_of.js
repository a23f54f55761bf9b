// What MediaPipe found in an unmirrored picture, as posed wants it. Which hand is one of the picture
// before, and of what side it is, posed decides: a single picture is often wrong.

const apart = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);

// Metres a width of the picture, about where the hand is: its points lie about their middle, and
// with them a hand that moves would not.
function widthOf(points, picture, aspect) {
  let [metres, widths] = [0, 0];
  const there = picture.map(({ x, y }) => ({ x, y: y / aspect }));
  for (let i = 1; i < points.length; i += 1) {
    metres += apart(points[i], points[0]);
    widths += apart(there[i], there[0]);
  }
  return metres / Math.max(widths, 1e-6);
}

// MediaPipe often finds a hand twice: the surer one is kept of those whose wrists are closer than
// half of the way to the middle finger's knuckle.
export function distinct(hands, aspect) {
  const far = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, (ay - by) / aspect);
  const kept = [];
  for (const hand of [...hands].sort((a, b) => b.score - a.score)) {
    const same = ({ picture }) =>
      far(picture[0], hand.picture[0]) < far(picture[0], picture[9]) / 2;
    if (!kept.some(same)) kept.push(hand);
  }
  return kept;
}

// [{side, score, points: 63 metres (x right, y down, z away, from the picture's middle), picture:
// 21 [x, y] of 0 to 1}]. `aspect`: the picture's width over its height.
export function handsOf(found, aspect) {
  const hands = (found?.multiHandWorldLandmarks ?? []).flatMap((points, i) => {
    if (points.length !== 21) return [];
    const picture = found.multiHandLandmarks[i];
    const { label, score } = found.multiHandedness[i];
    const width_m = widthOf(points, picture, aspect);
    const shift = {
      x: (picture[0].x - 0.5) * width_m - points[0].x,
      y: ((picture[0].y - 0.5) / aspect) * width_m - points[0].y,
    };
    return {
      // It is made for the mirrored pictures of a selfie: there a left hand looks like a right one.
      side: label === 'Left' ? 'right' : 'left',
      score: Math.min(1, score),
      points: points.flatMap(({ x, y, z }) => [x + shift.x, y + shift.y, z]),
      picture: picture.map(({ x, y }) => [x, y]),
    };
  });
  return distinct(hands, aspect);
}

const rounded = (value, digits) => Number(value.toFixed(digits));

// The message to posed (drivers/landmarks/README.md). `side`: the user's own word, or ''.
export function landmarksMessage(hands, { time_ms, side = '' }) {
  const sent = side === '' ? hands : best(hands).map((hand) => ({ ...hand, side, sure: true }));
  return {
    posed: 'landmarks',
    version: 1,
    time_ns: Math.round(time_ms * 1e6),
    hands: sent.map((hand) => ({
      side: hand.side,
      ...(hand.sure ? { sure: true } : {}),
      score: rounded(hand.score, 3),
      points: hand.points.map((x) => rounded(x, 6)),
    })),
  };
}

const best = (hands) => [...hands].sort((a, b) => b.score - a.score).slice(0, 1);
