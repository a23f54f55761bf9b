// The messages of proto/wire/posed/v1 that the page reads or writes, except Frame (pose.js).
// Of each: the fields that the page needs, by number: [name, type], and what it is: repeated ('*')
// or optional ('?'). A test compares the tables with the .proto files.

export const Skeleton = {
  1: ['stream', 'string'],
  2: ['id', 'fixed32'],
  3: ['name', 'string'],
  4: ['joint_name', 'string', '*'],
  5: ['parent', 'sint', '*'],
  6: ['offset_m', 'float', '*'],
  7: ['humanoid_bone', 'string', '*'],
  8: ['T_world_joint_xyzw', 'float', '*'],
  11: ['root_joint', 'uint'],
  12: ['rate_hz', 'double'],
  13: ['stage', 'string', '*'],
  14: ['end_site_m', 'float', '*'],
  15: ['capsule_joint', 'uint', '*'],
  16: ['capsule_m', 'float', '*'],
};

export const Sample = {
  1: ['stream', 'string'],
  5: ['name', 'string', '*'],
  7: ['value', 'float', '*'],
  8: ['validity', 'bytes'],
};

export const Event = {
  1: ['stream', 'string'],
  2: ['kind', 'uint'],
  3: ['time_ns', 'int'],
  4: ['sequence', 'uint'],
  5: ['text', 'string'],
};

export const Percentiles = {
  1: ['p50_us', 'float'],
  2: ['p99_us', 'float'],
  3: ['max_us', 'float'],
};

export const ParameterStats = {
  1: ['name', 'string'],
  2: ['value', 'double'],
  3: ['target', 'double'],
  4: ['text', 'string'],
};

export const StageStats = {
  1: ['name', 'string'],
  2: ['time', Percentiles, '?'],
  3: ['parameter', ParameterStats, '*'],
  4: ['model', 'string'],
  5: ['word', 'string', '*'],
};

export const StreamStats = {
  1: ['stream', 'string'],
  2: ['driver', 'string'],
  3: ['state', 'string'],
  4: ['frames', 'uint'],
  6: ['rate_hz', 'float'],
  7: ['dropped', 'uint'],
  8: ['shed', 'uint'],
  9: ['outcome', 'uint', '*'],
  12: ['publish', Percentiles, '?'],
  13: ['alpha', 'float'],
  14: ['model', 'string'],
  15: ['lag_frames', 'uint'],
  16: ['lag_ms', 'float'],
  19: ['away', 'bool'],
  20: ['connections', 'uint'],
  21: ['clock_offset_ns', 'int', '?'],
  22: ['clock_drift_ppm', 'float'],
  23: ['link_ns', 'int'],
  24: ['identity', 'string'],
  25: ['device_info', 'string'],
  26: ['alpha_target', 'float'],
  28: ['stage', StageStats, '*'],
  29: ['source_name', 'string'],
  30: ['body', 'string'],
  31: ['refusal', 'string'],
  32: ['kernel_dropped', 'uint'],
  34: ['style_estimate', 'float', '?'],
  35: ['style_gate', 'float', '?'],
  36: ['lossy', 'bool'],
  37: ['gate_dropped', 'float', '?'],
  38: ['gate_joint', 'string'],
  39: ['robot_limited', 'uint', '?'],
  40: ['robot_stops', 'uint', '?'],
  41: ['robot_hard_stops', 'uint', '?'],
  42: ['robot_holds', 'uint', '?'],
  43: ['robot_stop_joint', 'string'],
  44: ['robot_stop_other', 'string'],
};

export const SourceStats = {
  1: ['name', 'string'],
  2: ['driver', 'string'],
  3: ['identity', 'string'],
  4: ['away', 'bool'],
  6: ['outcome', 'uint', '*'],
  7: ['streams', 'uint'],
  8: ['kernel_dropped', 'uint'],
};

export const OutputStats = {
  1: ['name', 'string'],
  2: ['kind', 'string'],
  3: ['receivers', 'uint'],
  4: ['frames', 'uint'],
  5: ['sent', 'uint'],
  6: ['dropped', 'uint'],
  7: ['failures', 'uint'],
  8: ['address', 'string'],
};

export const TakeStats = {
  1: ['number', 'uint'],
  2: ['name', 'string'],
  3: ['start_ns', 'int'],
  5: ['lost_chunks', 'uint'],
};

export const Stats = {
  1: ['time_ns', 'int'],
  3: ['stream', StreamStats, '*'],
  4: ['cpu_percent', 'float'],
  5: ['rss_bytes', 'uint'],
  6: ['recorder_lost_chunks', 'uint'],
  7: ['recorder_errors', 'uint'],
  8: ['recorder_file', 'string'],
  9: ['replay_file', 'string'],
  11: ['source', SourceStats, '*'],
  14: ['output', OutputStats, '*'],
  15: ['take', TakeStats, '?'],
  16: ['recorder_trouble', 'string'],
};

const SetParameter = {
  1: ['stream', 'string'],
  2: ['name', 'string'],
  3: ['number', 'double', '?'],
  4: ['flag', 'bool', '?'],
  5: ['text', 'string', '?'],
};

const NumberEntry = { 1: ['key', 'string'], 2: ['value', 'double'] }; // of a map
const StageCommand = {
  1: ['stream', 'string'],
  2: ['name', 'string'],
  3: ['word', 'string', '*'],
  4: ['number', NumberEntry, '*'],
};

const ModelPart = {
  1: ['stream', 'string'],
  2: ['sha256', 'string'],
  3: ['total', 'uint'],
  4: ['offset', 'uint'],
  5: ['bytes', 'bytes'],
  6: ['name', 'string'],
};

const Take = { 1: ['start', 'bool'], 2: ['name', 'string'] };
const UseModel = { 1: ['stream', 'string'], 2: ['name', 'string'], 3: ['stage', 'string'] };
const FetchRecording = {
  1: ['name', 'string'],
  2: ['offset', 'uint'],
  3: ['as', 'string'],
  4: ['from_s', 'double'],
  5: ['to_s', 'double'],
};
const RenameModel = { 1: ['name', 'string'], 2: ['to', 'string'] };
const DeleteModel = { 1: ['name', 'string'] };
const Nothing = {};

const Mark = { 1: ['style', 'bool'], 2: ['seconds', 'double'], 3: ['more', 'bool'] };
const Train = { 1: ['name', 'string'], 2: ['signs', 'bool'] };
const Show = { 1: ['label', 'string'], 2: ['seconds', 'double'] };
const Forget = { 1: ['label', 'string'] };
const Teach = {
  1: ['stream', 'string'],
  2: ['mark', Mark, '?'],
  3: ['train', Train, '?'],
  4: ['cancel', Nothing, '?'],
  5: ['show', Show, '?'],
  6: ['forget', Forget, '?'],
};

const Held = {
  1: ['sensor', 'string'],
  2: ['count', 'uint'],
  3: ['sum', 'double'],
  4: ['squares', 'double'],
};
const HeldPose = { 1: ['name', 'string'], 2: ['held', Held, '*'] };
const FitGlove = { 1: ['stream', 'string'], 2: ['pose', HeldPose, '*'], 3: ['name', 'string'] };

export const ControlRequest = {
  3: ['status', Nothing, '?'],
  9: ['model_part', ModelPart, '?'],
  10: ['set_parameter', SetParameter, '?'],
  11: ['stage_command', StageCommand, '?'],
  12: ['take', Take, '?'],
  13: ['list_models', Nothing, '?'],
  14: ['use_model', UseModel, '?'],
  15: ['teach', Teach, '?'],
  20: ['list_recordings', Nothing, '?'],
  21: ['fetch_recording', FetchRecording, '?'],
  22: ['rename_model', RenameModel, '?'],
  23: ['delete_model', DeleteModel, '?'],
  24: ['fit_glove', FitGlove, '?'],
};

const KnownModel = {
  1: ['name', 'string'],
  2: ['kind', 'string'],
  3: ['learnt', 'string'],
  4: ['skeleton', 'string'],
  5: ['verdict', 'string'],
  6: ['strip', 'string'],
};

const KnownRecording = {
  1: ['name', 'string'],
  2: ['bytes', 'uint'],
  3: ['changed_unix_s', 'int'],
  4: ['in_use', 'bool'],
  5: ['being_made', 'bool'],
  6: ['problem', 'string'],
};

const TaughtWalk = { 1: ['good', 'bool'], 2: ['sentence', 'string'], 3: ['takes', 'uint'] };
const TaughtSign = { 1: ['label', 'string'], 2: ['shows', 'uint'] };
const Teaching = {
  1: ['stream', 'string'],
  2: ['step', 'uint'],
  3: ['style', 'bool'],
  4: ['seconds_left', 'double'],
  5: ['neutral_walk', TaughtWalk, '?'],
  6: ['style_walk', TaughtWalk, '?'],
  7: ['model', 'string'],
  8: ['sequence', 'uint'],
  9: ['train_s', 'double'],
  10: ['verdict', 'string'],
  11: ['problem', 'string'],
  12: ['label', 'string'],
  13: ['show', TaughtWalk, '?'],
  14: ['sign', TaughtSign, '*'],
};

const FitVerdict = { 1: ['pose', 'string'], 2: ['good', 'bool'], 3: ['sentence', 'string'] };
const GloveFit = {
  1: ['verdict', FitVerdict, '*'],
  2: ['sentence', 'string', '*'],
  3: ['file', 'string'],
};

export const ControlReply = {
  1: ['ok', 'bool'],
  2: ['error', 'string'],
  3: ['stream', 'string'],
  4: ['sequence', 'uint'],
  5: ['status', Stats, '?'],
  6: ['take', TakeStats, '?'],
  7: ['model', KnownModel, '*'],
  8: ['recorder_trouble', 'string'],
  9: ['teaching', Teaching, '?'],
  20: ['recording', KnownRecording, '*'],
  21: ['piece', 'bytes', '?'],
  22: ['fit', GloveFit, '?'],
};

// posed.v1.Event.Kind, by number.
export const EVENT_KINDS = [
  '',
  'started',
  'stale',
  'recovered',
  'ended',
  'control',
  'shed',
  'recording gap',
  'recording error',
  'warning',
  'playing',
  'played',
  'lost',
  'found',
  'calibrated',
  'clock jumped',
  'take',
];
