// What comes into the daemon and where it goes: each device and each output with its address, its
// state, its counts, and a line on how to connect.
import { stateOf } from '../streams/words.js';
import { el, write } from './dom.js';

// By driver; of the gloves, which have many, the last.
const INPUTS = {
  file: 'A clip that is played as if it were a device.',
  posed: 'Another posed, or a relay: its ZeroMQ address.',
  natnet: 'OptiTrack Motive: Streaming on, skeletons and rigid bodies, to this computer.',
  mvn: 'Xsens MVN: Options, Network Streamer: this computer and port, quaternions.',
  vmc: 'A VMC performer: send to this address.',
  axis: 'Perception Neuron’s program: broadcast BVH over TCP.',
  rokoko: 'Rokoko Studio: a custom live stream to this computer and port.',
  mocopi: 'mocopi app: send over UDP to this computer and port.',
  landmarks: 'Hands of a webcam: “Use my camera” on this page.',
};
const GLOVE = 'A glove: plug it in; “posed devices” lists what is found.';

const OUTPUTS = {
  vmc: 'VSeeFace and other avatar programs: switch on the VMC receiver with this port.',
  mvn: 'Unreal’s Live Link for Xsens, and what else listens to MVN: this port.',
  rokoko: 'Blender’s and other plugins of Rokoko: start the receiver with this port.',
  mocopi: 'Receivers of mocopi: this port.',
  natnet: 'Clients of OptiTrack Motive: this address as the server.',
  bvh: 'Clients of Axis Neuron: connect to this address over TCP.',
  axis: 'Programs built on Axis Neuron’s SDK: this address.',
  ros2: 'ROS 2 nodes with the same ROS_DOMAIN_ID.',
};
const MORE = [
  'More ways out by [[output]] tables in the config: kind vmc (VSeeFace), mvn (Unreal), rokoko (Blender), natnet, mocopi, axis, bvh, ros2.',
  'OBS: capture this window. Settings, Background: green, to key it out.',
  'Clips for Blender and Unreal: Recordings, below.',
  'In Python (package python3-posed, or build/python):',
];
const python = (address) => `posed.Client("${address}")`;

const OK = 0; // Outcome
const FOREIGN = 4; // of another sender; late ones and duplicates behind it: no fault either

const many = (count, what) => `${count.toLocaleString('en')} ${what}${count === 1 ? '' : 's'}`;

const sum = (counts) => counts.reduce((all, count) => all + count, 0);

function countsOf({ driver, outcome, kernel_dropped }) {
  const damaged = sum(outcome.slice(OK + 1, FOREIGN));
  const other = driver === 'landmarks' ? (outcome[FOREIGN] ?? 0) : 0;
  return [
    kernel_dropped > 0 && `${many(kernel_dropped, 'datagram')} lost in the kernel`,
    damaged > 0 && `${many(damaged, 'packet')} not understood`,
    other > 0 && `${many(other, 'message')} of another version, or of a hand seen less than three times`,
  ].filter(Boolean);
}

const rate = ({ rate_hz }) => `${rate_hz.toFixed(1)} Hz`;

function inputOf(stream) {
  const { word, tone } = stateOf(stream);
  return {
    name: stream.stream,
    word,
    tone,
    address: [stream.driver, stream.identity].filter(Boolean).join(', '),
    counts: [word === 'live' && rate(stream), ...countsOf(stream)],
    how: INPUTS[stream.driver] ?? GLOVE,
  };
}

// A device with several bodies. before: what its stats were a second ago
function sourceOf(source, streams, before = source) {
  const own = streams.filter(({ source_name: of }) => of === source.name);
  const live = own.filter(({ state }) => state === 'live');
  // Of a tracker that somebody writes, whatever its messages lack is refused.
  const since = source.outcome.map((count, i) => count - (before.outcome[i] ?? 0));
  const refused = source.driver === 'landmarks' ? sum(since.slice(OK + 1, FOREIGN + 1)) : 0;
  const [word, tone] = source.away
    ? ['absent', 'busy']
    : live.length > 0
      ? ['live', 'good']
      : refused > (since[OK] ?? 0)
        ? ['messages refused', 'bad']
        : [source.driver === 'landmarks' ? 'not in use' : 'nothing comes', 'off'];
  return {
    name: source.name,
    word,
    tone,
    address: [source.driver, source.identity].filter(Boolean).join(', '),
    counts: [...live.map((one) => `${one.stream} ${rate(one)}`), ...countsOf(source)],
    how: INPUTS[source.driver] ?? GLOVE,
  };
}

// before: what its stats were a second ago
function outputOf(output, before = output) {
  const { name, kind, address, receivers, frames, sent, dropped, failures } = output;
  const failed = failures > before.failures;
  const nobody = receivers === 0;
  const [word, tone] = nobody
    ? ['nobody listens', 'off']
    : failed
      ? ['refused', 'bad']
      : ['sends', 'good'];
  return {
    name,
    word: frames > 0 || nobody ? word : 'waiting',
    tone: frames > 0 || nobody ? tone : 'busy',
    address: [kind, address].filter(Boolean).join(', '),
    counts: [
      `${many(sent, 'message')} to ${many(receivers, 'receiver')}`,
      dropped > 0 && `${many(dropped, 'frame')} dropped`,
      failures > 0 && `${many(failures, 'sending')} refused so far`,
      failed && 'does it listen there?',
    ],
    how: OUTPUTS[kind] ?? '',
  };
}

// stats: posed.v1.Stats, whose counts are totals; connect: the address that the daemon publishes at;
// before: the stats before these, which tell what happens now
export function waysOf(stats, connect, before = stats) {
  const replay = stats.replay_file && {
    name: 'replay',
    word: 'live',
    tone: 'good',
    address: stats.replay_file,
    counts: [],
    how: 'A recorded log is played again.',
  };
  const earlier = (list, name) => list.find((one) => one.name === name);
  const inputs = replay
    ? [replay]
    : [
        ...stats.stream.filter(({ source_name: of }) => of === '').map(inputOf),
        ...stats.source.map((source) =>
          sourceOf(source, stats.stream, earlier(before.source, source.name)),
        ),
      ];
  const zeromq = {
    name: 'ZeroMQ',
    word: 'sends',
    tone: 'good',
    address: connect,
    counts: ['every stream, for programs of your own'],
    how: 'Python as below; C++ and Unity: the folder proto/clients.',
  };
  const output = (one) => outputOf(one, earlier(before.output, one.name));
  return { inputs, outputs: [zeromq, ...stats.output.map(output)] };
}

export class Ways {
  #shown = '';
  #stats = null; // the last ones, and those before
  #before = null;

  // refresh(): asks for an update, when it is unfolded
  constructor(refresh) {
    this.title = el('summary', {}, 'Inputs and outputs');
    this.inputs = el('ul.shelf');
    this.outputs = el('ul.shelf');
    this.python = el('code', { tabIndex: 0 });
    this.element = el(
      'section.ways',
      { hidden: true },
      el(
        'details',
        { ontoggle: refresh },
        this.title,
        el('h3', {}, 'In'),
        this.inputs,
        el('h3', {}, 'Out'),
        this.outputs,
        ...MORE.map((text) => el('p.note', {}, text)),
        el('div.copy', {}, this.python),
      ),
    );
  }

  // stats: null while nobody tells
  update(stats, connect) {
    this.element.hidden = !stats;
    if (!stats) return;
    if (stats !== this.#stats) [this.#before, this.#stats] = [this.#stats ?? stats, stats];
    const { inputs, outputs } = waysOf(stats, connect, this.#before);
    write(this.title, `Inputs and outputs: ${inputs.length} in, ${outputs.length} out`);
    write(this.python, python(connect));
    const shown = JSON.stringify([inputs, outputs]);
    if (shown === this.#shown || !this.element.firstChild.open) return;
    this.#shown = shown;
    this.inputs.replaceChildren(...inputs.map(row));
    this.outputs.replaceChildren(...outputs.map(row));
  }
}

function row({ name, word, tone, address, counts, how }) {
  return el(
    'li',
    {},
    el('p.way', {}, el('strong', {}, name), el('span.state', { data: { tone } }, word)),
    ...[[address, ...counts].filter(Boolean).join('; '), how]
      .filter(Boolean)
      .map((text) => el('p.note', {}, text)),
  );
}
