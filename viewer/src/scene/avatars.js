// The avatars that bodies may wear: the mannequin, which they begin with, and files that were
// dropped on the scene. Each
// body needs an avatar of its own, loaded from the same bytes. The loader comes when it is needed.

const MANNEQUIN = 'mannequin';

// The loader keeps the bytes it is given, so it gets its own.
async function load(bytes, name) {
  const { loadAvatar } = await import('./avatar.js');
  return loadAvatar(bytes.slice(0), name);
}

export class Avatars {
  #files = new Map([[MANNEQUIN, null]]); // name: its bytes, once they are here
  #chosen = MANNEQUIN;

  // say(sentence, tone); changed(names, chosen)
  constructor(world, say, changed) {
    Object.assign(this, { world, say, changed });
    this.#listen(world.stage);
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
      if (file) await this.#take(file);
    });
  }

  async #take(file) {
    const name = file.name.replace(/\.(vrm|glb)$/i, '');
    const bytes = await file.arrayBuffer();
    try {
      (await load(bytes, name)).dispose(); // also while no body is there to wear it
    } catch (error) {
      this.say(error.message, 'bad');
      return;
    }
    this.#files.set(name, bytes);
    await this.wear(name);
  }

  // name: null for capsules
  async wear(name) {
    const before = this.#chosen;
    this.#chosen = name;
    try {
      for (const performer of this.world.performers.values()) await this.dress(performer);
    } catch (error) {
      this.say(error.message, 'bad');
      if (this.#chosen === name) this.#chosen = before;
    }
    this.changed([...this.#files.keys()], this.#chosen ?? '');
    this.world.touch();
  }

  // Gives a performer the chosen avatar: styled bodies only, raw ones stay ghosts. While it loads
  // another one may be chosen, or the body may leave: then it is not worn.
  async dress(performer) {
    if (performer.ghost || performer.stream.isHand) return;
    const name = this.#chosen;
    if (name === null) {
      performer.wear(null);
      return;
    }
    const avatar = await load(await this.#bytes(name), name);
    const isThere = this.world.performers.get(performer.stream.name) === performer;
    if (isThere && this.#chosen === name) performer.wear(avatar);
    else avatar.dispose();
  }

  async #bytes(name) {
    if (!this.#files.get(name)) {
      const coarse = this.world.fine ? '' : '-coarse'; // fewer vertices for the processor
      const answer = await fetch(`/${MANNEQUIN}${coarse}.vrm`);
      if (!answer.ok) throw new Error(`the ${MANNEQUIN} is not in the page's folder`);
      this.#files.set(name, await answer.arrayBuffer());
    }
    return this.#files.get(name);
  }
}
