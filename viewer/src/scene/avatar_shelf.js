// Avatars of one's own: files' bytes by name, kept in the browser where it allows that.
const SHELF = 'avatars';

const answer = (request) =>
  new Promise((done, fail) => {
    request.onsuccess = () => done(request.result);
    request.onerror = () => fail(request.error);
  });

async function open() {
  const request = indexedDB.open('posed', 1);
  request.onupgradeneeded = () => request.result.createObjectStore(SHELF);
  return answer(request);
}

// In a private window, say, nothing is kept: what was read is then undefined.
async function use(mode, ask) {
  try {
    const database = await open();
    const done = await answer(ask(database.transaction(SHELF, mode).objectStore(SHELF)));
    database.close();
    return done;
  } catch {
    return undefined;
  }
}

export const keptNames = async () => (await use('readonly', (shelf) => shelf.getAllKeys())) ?? [];
export const keptBytes = (name) => use('readonly', (shelf) => shelf.get(name));
export const keepBytes = (name, bytes) => use('readwrite', (shelf) => shelf.put(bytes, name));
export const forget = (name) => use('readwrite', (shelf) => shelf.delete(name));
