// What MediaPipe found in an unmirrored picture, as posed wants it: at most one hand a side.

const flat = (points) => points.flatMap(({ x, y, z }) => [x, y, z]);

// [{side, score, points: 63 metres (x right, y down, z away), picture: 21 [x, y] of 0 to 1}]
export function handsOf(found) {
  const best = new Map();
  (found?.multiHandWorldLandmarks ?? []).forEach((points, i) => {
    const { label, score } = found.multiHandedness[i];
    // It is made for mirrored pictures, as those of a selfie: there a left hand looks like a right.
    const side = label === 'Left' ? 'right' : 'left';
    if (points.length !== 21 || (best.get(side)?.score ?? 0) >= score) return;
    const picture = found.multiHandLandmarks[i].map(({ x, y }) => [x, y]);
    best.set(side, { side, score: Math.min(1, score), points: flat(points), picture });
  });
  return [...best.values()];
}

const rounded = (value, digits) => Number(value.toFixed(digits));

// The message to posed (drivers/landmarks/README.md). `side`: the user's own word, or ''.
export function landmarksMessage(hands, { time_ms, side = '' }) {
  const sent = side === '' ? hands : best(hands).map((hand) => ({ ...hand, side }));
  return {
    posed: 'landmarks',
    version: 1,
    time_ns: Math.round(time_ms * 1e6),
    hands: sent.map((hand) => ({
      side: hand.side,
      score: rounded(hand.score, 3),
      points: hand.points.map((x) => rounded(x, 6)),
    })),
  };
}

const best = (hands) => [...hands].sort((a, b) => b.score - a.score).slice(0, 1);
