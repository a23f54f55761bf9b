// Names above the figures, as text of the page: sharp at any size, read by screen readers. One that
// would cover another stands above it, or below where there is no room.

const GAP_PX = 3;

export class NameTags {
  #tags = new Map(); // key: {element, title, detail, wide, high, x, y}
  #placed = []; // tags of this picture
  #sizes = new ResizeObserver((entries) => {
    for (const { target, borderBoxSize } of entries) {
      const tag = this.#tags.get(target.dataset.key);
      if (tag) [tag.wide, tag.high] = [borderBoxSize[0].inlineSize, borderBoxSize[0].blockSize];
    }
  });

  constructor(layer) {
    this.layer = layer;
  }

  // Writes a tag's text; it appears with the first `place`.
  write(key, { title, detail, kind, chosen, colour }) {
    const tag = this.#tags.get(key) ?? this.#make(key);
    tag.element.dataset.kind = kind;
    tag.element.dataset.chosen = chosen;
    tag.element.style.setProperty('--own', colour);
    if (tag.title.textContent !== title) tag.title.textContent = title;
    if (tag.detail.textContent !== detail) tag.detail.textContent = detail;
  }

  #make(key) {
    const element = document.createElement('div');
    element.className = 'name-tag';
    element.dataset.key = key;
    element.hidden = true;
    const title = document.createElement('strong');
    const detail = document.createElement('span');
    element.append(title, detail);
    this.layer.append(element);
    this.#sizes.observe(element);
    const tag = { element, title, detail, wide: 0, high: 0 };
    this.#tags.set(key, tag);
    return tag;
  }

  // So wide at most [CSS pixels], that none covers its neighbour.
  limit(key, wide) {
    const tag = this.#tags.get(key);
    if (!tag || tag.most === wide) return;
    tag.most = wide;
    tag.element.style.maxWidth = `${wide}px`;
  }

  // In CSS pixels.
  widthOf(key) {
    return this.#tags.get(key)?.wide ?? 0;
  }

  // Before the first `place` of a picture.
  begin() {
    this.#placed.length = 0;
  }

  // point: in the picture, -1 to 1; the name stands above it, or hangs below. area: of the viewport in CSS pixels {left, top, width, height, covered}:
  // `covered` pixels at its upper edge stay free.
  place(key, at, area, below = false) {
    const tag = this.#tags.get(key);
    if (!tag) return;
    const shown = at.z < 1 && Math.abs(at.x) < 1.1 && Math.abs(at.y) < 1.1;
    if (tag.element.hidden === shown) tag.element.hidden = !shown;
    if (!shown) return;
    // Whole pixels, and only when they change: each move costs the browser a layer.
    const half = 0.5 * tag.wide;
    const middle = Math.min((0.5 + 0.5 * at.x) * area.width, area.width - half);
    const x = Math.round(area.left + Math.max(middle, half)); // its words are whole at an edge, too
    const edge = area.top + (0.5 - 0.5 * at.y) * area.height;
    const wanted = below ? Math.min(edge + tag.high, area.top + area.height) : edge;
    const top = area.top + area.covered + tag.high;
    const y = Math.round(this.#freeFrom(tag, x, Math.max(wanted, top), top));
    this.#placed.push(tag);
    if (x === tag.x && y === tag.y) return;
    tag.x = x;
    tag.y = y;
    tag.element.style.transform = `translate(${x}px, ${y}px) translate(-50%, -100%)`;
  }

  // The lower edge of a tag at x that covers none of those that have their place.
  #freeFrom(tag, x, wanted, top) {
    let y = wanted;
    let step = -1;
    for (let i = 0; i < this.#placed.length; i += 1) {
      const other = this.#placed[i];
      const beside = Math.abs(other.x - x) >= 0.5 * (other.wide + tag.wide) + GAP_PX;
      if (beside || y <= other.y - other.high || y - tag.high >= other.y) continue;
      if (step < 0 && other.y - other.high - GAP_PX < top) step = 1;
      y = step < 0 ? other.y - other.high - GAP_PX : other.y + tag.high + GAP_PX;
      i = -1; // it may cover another one there
    }
    return y;
  }

  hide(key) {
    const tag = this.#tags.get(key);
    if (tag) tag.element.hidden = true;
  }

  remove(key) {
    const tag = this.#tags.get(key);
    if (!tag) return;
    this.#sizes.unobserve(tag.element);
    tag.element.remove();
    this.#tags.delete(key);
  }
}
