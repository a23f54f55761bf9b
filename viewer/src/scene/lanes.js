// Where the figures stand beside each other. Streams of different devices know nothing of each
// other's place, so each has a lane; bodies of one device share theirs, as they were captured.

export const LANE_M = 1.15;

// mains: streams in order, without hands. hasRaw(stream): whether its raw twin is shown beside it.
// Returns the offset in lanes of each by name: {styled, raw}.
export function lanesOf(mains, hasRaw) {
  const groups = new Map(); // device or stream: its streams
  for (const stream of mains) {
    const device = stream.stats?.source_name || ` ${stream.name}`;
    if (!groups.has(device)) groups.set(device, []);
    groups.get(device).push(stream);
  }
  const places = new Map();
  let next = 0;
  for (const group of groups.values()) {
    const beside = group.some(hasRaw);
    for (const stream of group)
      places.set(stream.name, { raw: next, styled: beside ? next + 1 : next });
    next += beside ? 2 : 1;
  }
  const middle = (next - 1) / 2;
  for (const place of places.values()) {
    place.raw -= middle;
    place.styled -= middle;
  }
  return places;
}
