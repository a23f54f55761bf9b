// The avatars that bodies may wear: the mannequin, which they begin with, and files of one's own.
// All wear the same one, but for those for whom another one was chosen. Each body needs an avatar
// of its own, loaded from the same bytes. The loader comes when it is needed.
import { keep, kept } from '../panel/settings.js';
import { forget, keepBytes, keptBytes, keptNames } from './avatar_shelf.js';

export const MANNEQUIN = 'mannequin';
export const BONES = ''; // no avatar
const ENDING = /\.(vrm|glb)$/i;

const keyOf = (stream) => (stream ? `figure.${stream}` : 'figure');

// The loader keeps the bytes it is given, so it gets its own.
async function load(bytes, name) {
  const { loadAvatar } = await import('./avatar.js');
  return loadAvatar(bytes.slice(0), name);
}

export class Avatars {
  #files = new Map([[MANNEQUIN, null]]); // name: its bytes, once they are here

  // say(sentence, tone); changed(): there are other avatars, or another one is worn
  constructor(world, say, changed) {
    Object.assign(this, { world, say, changed });
    this.ready = this.#recall();
    this.#listen(world.stage);
  }

  async #recall() {
    for (const name of await keptNames()) this.#files.set(name, null);
    this.changed();
  }

  #listen(stage) {
    stage.addEventListener('dragover', (event) => {
      event.preventDefault();
      stage.dataset.drop = '';
    });
    stage.addEventListener('dragleave', () => {
      delete stage.dataset.drop;
    });
    stage.addEventListener('drop', async (event) => {
      event.preventDefault();
      delete stage.dataset.drop;
      const [file] = event.dataTransfer.files;
      if (file) await this.take(file);
    });
  }

  get names() {
    return [...this.#files.keys()];
  }

  isOwn(name) {
    return name !== MANNEQUIN && this.#files.has(name);
  }

  // What was chosen for this stream, or for all (no name); null: as all.
  chosen(stream = '') {
    const name = kept(keyOf(stream));
    if (name === BONES || this.#files.has(name)) return name;
    return stream ? null : MANNEQUIN;
  }

  // A file of one's own, for this stream or for all.
  async take(file, stream = '') {
    const name = file.name.replace(ENDING, '');
    const bytes = await file.arrayBuffer();
    try {
      (await load(bytes, name)).dispose(); // also while no body is there to wear it
    } catch (error) {
      this.say(error.message, 'bad');
      return;
    }
    for (const performer of this.world.performers.values())
      if (performer.avatar?.name === name) performer.wear(null); // it may look otherwise now
    this.#files.set(name, bytes);
    await keepBytes(name, bytes);
    await this.wear(name, stream);
  }

  async forget(name) {
    this.#files.delete(name);
    await forget(name);
    await this.#dressAll();
  }

  // name: BONES for no avatar; null: as all
  async wear(name, stream = '') {
    keep(keyOf(stream), name);
    await this.#dressAll();
  }

  async #dressAll() {
    for (const performer of this.world.performers.values()) {
      try {
        await this.dress(performer);
      } catch (error) {
        this.say(error.message, 'bad');
      }
    }
    this.changed();
    this.world.touch();
  }

  // Gives a performer the chosen avatar: styled bodies only, raw ones stay ghosts. While it loads
  // another one may be chosen, or the body may leave: then it is not worn.
  async dress(performer) {
    if (performer.ghost || performer.stream.isHand) return;
    await this.ready;
    const wanted = () => this.chosen(performer.stream.name) ?? this.chosen();
    const name = wanted();
    if (name === (performer.avatar?.name ?? BONES)) return;
    if (name === BONES) {
      performer.wear(null);
      return;
    }
    const avatar = await load(await this.#bytes(name), name);
    const isThere = this.world.performers.get(performer.stream.name) === performer;
    if (isThere && wanted() === name) performer.wear(avatar);
    else avatar.dispose();
  }

  async #bytes(name) {
    if (!this.#files.get(name)) this.#files.set(name, await this.#fetch(name));
    return this.#files.get(name);
  }

  async #fetch(name) {
    if (name !== MANNEQUIN) {
      const bytes = await keptBytes(name);
      if (!bytes) throw new Error(`${name} is no longer kept in this browser: choose its file again`);
      return bytes;
    }
    const coarse = this.world.fine ? '' : '-coarse'; // fewer vertices for the processor
    const answer = await fetch(`/${MANNEQUIN}${coarse}.vrm`);
    if (!answer.ok) throw new Error(`the ${MANNEQUIN} is not in the page's folder`);
    return answer.arrayBuffer();
  }
}
