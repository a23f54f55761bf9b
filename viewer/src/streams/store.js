// All streams, by name, as the messages of the bridge bring them.
import { Event, Sample, Skeleton, Stats, EVENT_KINDS } from '../wire/schema.js';
import { Pose, readPose } from '../wire/pose.js';
import { decode } from '../wire/message.js';
import { Words } from '../wire/words.js';
import { Rewind } from './rewind.js';
import { RAW_SUFFIX, Stream } from './stream.js';

const MOST_STREAMS = 256;
const MOST_EVENTS = 64;
const ABSENT_FOR = 3; // statistics, until a stream is gone

export class Store extends EventTarget {
  streams = new Map();
  stats = null; // posed.v1.Stats
  stats_at_ms = NaN; // performance.now() when they came
  events = []; // {stream, kind, text, sequence}, oldest first
  damaged = 0; // messages that could not be read
  rewind = new Rewind();
  #topics = new Words();
  #spare = new Pose();
  #listening = null;

  // A binary message of the bridge. reply(number, bytes, from): an answer to a request.
  receive(bytes, reply) {
    const size = bytes[0] ?? 0;
    const topic = this.#topics.at(bytes, 1, Math.min(size, bytes.length - 1));
    try {
      this.#read(topic, bytes, 1 + size, reply);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.damaged += 1;
    }
  }

  #read(topic, bytes, from, reply) {
    if (topic.startsWith('pose/')) this.#pose(topic, bytes, from);
    else if (topic.startsWith('skeleton/')) this.#skeleton(decode(Skeleton, bytes, from));
    else if (topic.startsWith('sensor/')) this.#sensors(topic, bytes, from);
    else if (topic.startsWith('event/')) this.#event(decode(Event, bytes, from));
    else if (topic === 'stats') this.#stats(decode(Stats, bytes, from));
    else if (topic.startsWith('reply/')) reply(Number(topic.slice(6)), bytes, from);
  }

  // take(sample): gets what the sensors of this stream say from now on; null: no longer.
  listen(stream, take) {
    this.#listening = take && { topic: `sensor/${stream}`, take };
  }

  // They come as often as poses and are read only for who listens.
  #sensors(topic, bytes, from) {
    if (topic === this.#listening?.topic) this.#listening.take(decode(Sample, bytes, from));
  }

  // Read into a spare pose first, so that a damaged message leaves the stream's as it was.
  #pose(topic, bytes, from) {
    const stream = this.#byTopic.get(topic) ?? this.#named(topic);
    if (!stream) return;
    const now_ms = performance.now();
    if (this.rewind.paused) {
      stream.absent = 0; // it is there; what is shown is the past
      return;
    }
    this.#exchange(stream, bytes, from);
    this.rewind.keep(topic, bytes, from, now_ms); // only what could be read
    stream.posed(now_ms);
  }

  #exchange(stream, bytes, from) {
    const pose = readPose(bytes, from, this.#spare);
    this.#spare = stream.pose;
    stream.pose = pose;
  }

  // Shows the scene as it was so long before the pause.
  look(ago_ms) {
    this.rewind.at(ago_ms, (topic, bytes, from) => {
      const stream = this.#byTopic.get(topic);
      if (!stream) return;
      this.#exchange(stream, bytes, from);
      stream.version += 1;
    });
  }

  #byTopic = new Map();

  #named(topic) {
    const stream = this.#stream(topic.slice(5));
    if (stream) this.#byTopic.set(topic, stream);
    return stream;
  }

  #stream(name) {
    let stream = this.streams.get(name);
    if (!stream && this.streams.size < MOST_STREAMS) {
      stream = new Stream(name);
      this.streams.set(name, stream);
    }
    return stream;
  }

  #skeleton(message) {
    const stream = this.#stream(message.stream);
    if (stream?.setSkeleton(message)) this.#tell('skeleton', stream);
  }

  #event({ stream, kind, text, sequence }) {
    const event = { stream, kind: EVENT_KINDS[kind] ?? '', text, sequence };
    this.events.push(event);
    if (this.events.length > MOST_EVENTS) this.events.shift();
    this.#tell('event', event);
  }

  #stats(stats) {
    this.stats = stats;
    this.stats_at_ms = performance.now();
    const names = new Set(stats.stream.map(({ stream }) => stream));
    for (const stream of this.streams.values()) stream.stats = null;
    for (const one of stats.stream) {
      const stream = this.#stream(one.stream);
      if (stream) stream.stats = one;
    }
    this.#forget(names);
    this.#tell('stats', stats);
  }

  // Bodies leave: their streams, and the raw ones beside them, go from the page. Not at once, for
  // the statistics may be older than a skeleton, which comes only once.
  #forget(names) {
    for (const [name, stream] of this.streams) {
      if (stream.isTake) continue;
      const base = stream.isRaw ? name.slice(0, -RAW_SUFFIX.length) : name;
      if (names.has(name) || names.has(base)) stream.absent = 0;
      else stream.absent += 1;
      if (stream.absent < ABSENT_FOR) continue;
      this.streams.delete(name);
      this.#byTopic.delete(`pose/${name}`);
      this.#tell('gone', stream);
    }
  }

  // Nobody says any more how the streams are.
  silence() {
    for (const stream of this.streams.values())
      if (stream.stats) stream.stats = { ...stream.stats, state: 'unknown', away: false };
  }

  // The streams that are chosen and controlled, in the daemon's order: not the raw ones.
  main() {
    return (this.stats?.stream ?? [])
      .map(({ stream }) => this.streams.get(stream))
      .filter((stream) => stream !== undefined);
  }

  // Those that stand in the scene: these, and recordings that are played beside them.
  shown() {
    return [...this.main(), ...[...this.streams.values()].filter(({ isTake }) => isTake)];
  }

  // A recording to play; null where there is no room. message: posed.v1.Skeleton, sound
  addTake(name, message) {
    if (this.streams.size >= MOST_STREAMS) return null;
    const stream = new Stream(name, true);
    stream.setSkeleton(message);
    this.streams.set(name, stream);
    this.#tell('skeleton', stream);
    return stream;
  }

  removeTake(stream) {
    this.streams.delete(stream.name);
    this.#tell('gone', stream);
  }

  raw(stream) {
    return this.streams.get(stream.name + RAW_SUFFIX);
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
