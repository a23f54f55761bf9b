// Names above the figures, as text of the page: sharp at any size, read by screen readers.
import { Vector3 } from 'three';

export class NameTags {
  #tags = new Map(); // key: {element, title, detail, key}

  constructor(layer) {
    this.layer = layer;
  }

  // Writes a tag's text; it appears with the first `place`.
  write(key, { title, detail, kind, chosen }) {
    const tag = this.#tags.get(key) ?? this.#make(key);
    tag.element.dataset.kind = kind;
    tag.element.dataset.chosen = chosen;
    if (tag.title.textContent !== title) tag.title.textContent = title;
    if (tag.detail.textContent !== detail) tag.detail.textContent = detail;
  }

  #make(key) {
    const element = document.createElement('div');
    element.className = 'name-tag';
    element.hidden = true;
    const title = document.createElement('strong');
    const detail = document.createElement('span');
    element.append(title, detail);
    this.layer.append(element);
    const tag = { element, title, detail };
    this.#tags.set(key, tag);
    return tag;
  }

  // point: in the scene. area: of the viewport in CSS pixels {left, top, width, height}.
  place(key, point, camera, area) {
    const tag = this.#tags.get(key);
    if (!tag) return;
    at.copy(point).project(camera);
    const shown = at.z < 1 && Math.abs(at.x) < 1.1 && Math.abs(at.y) < 1.1;
    if (tag.element.hidden === shown) tag.element.hidden = !shown;
    if (!shown) return;
    // Whole pixels, and only when they change: each move costs the browser a layer.
    const x = Math.round(area.left + (0.5 + 0.5 * at.x) * area.width);
    const y = Math.round(Math.max(area.top + (0.5 - 0.5 * at.y) * area.height, area.top + 48));
    if (x === tag.x && y === tag.y) return;
    tag.x = x;
    tag.y = y;
    tag.element.style.transform = `translate(${x}px, ${y}px) translate(-50%, -100%)`;
  }

  hide(key) {
    const tag = this.#tags.get(key);
    if (tag) tag.element.hidden = true;
  }

  remove(key) {
    this.#tags.get(key)?.element.remove();
    this.#tags.delete(key);
  }
}

const at = new Vector3();
