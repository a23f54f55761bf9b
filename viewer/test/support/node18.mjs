// What the page's modules expect of a browser and Debian's node 18 does not have.
import { webcrypto } from 'node:crypto';

globalThis.crypto ??= webcrypto;
globalThis.CustomEvent ??= class extends Event {
  constructor(type, { detail }) {
    super(type);
    this.detail = detail;
  }
};
globalThis.self ??= globalThis; // for GLTFLoader
