// What an empty scene says: why nothing is seen, and what to do.
import { write } from './dom.js';

export function emptyWords(element, { link, hello, daemon, store }) {
  write(element, sentence(link, hello, daemon, store));
}

function sentence(link, hello, daemon, store) {
  if (link.state === 'refused') return `${link.sentence}.`;
  if (!hello) return link.sentence ? `${link.sentence}.` : 'Connecting…';
  if (!daemon.alive) return daemon.sentence || 'The daemon does not answer.';
  if (!store.stats) return 'Waiting for the daemon’s streams…';
  if (store.stats.stream.length === 0) return 'The daemon has no streams yet.';
  return 'Waiting for the first pose…';
}
