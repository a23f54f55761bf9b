// What MediaPipe found in an unmirrored picture, as posed wants it: at most one hand a side.

const flat = (points) => points.flatMap(({ x, y, z }) => [x, y, z]);

const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]); // points of the picture

const NEAR = 0.25; // of the picture: the wrist of the same hand in the next one
const KEPT = 0.9; // of the votes before
const FORGOTTEN = 10; // pictures without the hand

// Keeps hands apart from picture to picture: which side a hand is, many pictures decide, because a
// single one is often wrong.
export class HandFinder {
  #before = []; // [{wrist, vote, lost}]: above 0 it is a right hand; lost for so many pictures

  // [{side, score, points: 63 metres (x right, y down, z away), picture: 21 [x, y] of 0 to 1}], at
  // most one a side: the surer one.
  handsOf(found) {
    const seen = (found?.multiHandWorldLandmarks ?? []).flatMap((points, i) => {
      const picture = found.multiHandLandmarks[i].map(({ x, y }) => [x, y]);
      const { label, score } = found.multiHandedness[i];
      if (points.length !== 21) return [];
      // It is made for mirrored pictures, as those of a selfie: there a left hand looks like a right.
      const vote = (label === 'Left' ? score : -score) + KEPT * this.#voteNear(picture[0]);
      return [{ vote, score: Math.min(1, score), points: flat(points), picture }];
    });
    const now = seen.map(({ vote, picture }) => ({ vote, wrist: picture[0], lost: 0 }));
    const gone = ({ wrist }) => now.every((hand) => apart(hand.wrist, wrist) > NEAR);
    const lost = this.#before.filter(gone);
    const kept = lost.map((hand) => ({ ...hand, lost: hand.lost + 1 }));
    this.#before = [...now, ...kept.filter((hand) => hand.lost < FORGOTTEN)];
    const best = new Map();
    for (const { vote, ...hand } of seen) {
      const side = vote > 0 ? 'right' : 'left';
      if ((best.get(side)?.score ?? 0) < hand.score) best.set(side, { side, ...hand });
    }
    return [...best.values()];
  }

  #voteNear(place) {
    let nearest = { distance: NEAR, vote: 0 };
    for (const { wrist, vote } of this.#before) {
      const distance = apart(wrist, place);
      if (distance < nearest.distance) nearest = { distance, vote };
    }
    return nearest.vote;
  }
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
