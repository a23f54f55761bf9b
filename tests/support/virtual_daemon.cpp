#include "tests/support/virtual_daemon.hpp"

#include <algorithm>
#include <array>
#include <random>

#include <catch2/catch.hpp>

#include "daemon/control/stage_requests.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/worker.hpp"
#include "daemon/record/recorder.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/log/digest.hpp"
#include "tests/support/copy_log.hpp"
#include "tests/support/file_limit.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/support/virtual_bodies.hpp"
#include "tests/support/virtual_stream_context.hpp"

namespace posed::test {
namespace {

constexpr std::int64_t kLogWriterEvery_ns = 50'000'000;
constexpr std::int64_t kMaxHoldup_ns = 400'000'000;
constexpr std::int64_t kMaxStep_ns = 8'000'000;  // while the builder is at work
constexpr int kItemsPublishedATurn = 32;

bool within(const std::vector<Spell>& spells) {
  return std::ranges::any_of(spells, [](const Spell& spell) {
    return at_ns(spell.from_s) <= virtual_now_ns && virtual_now_ns < at_ns(spell.until_s);
  });
}

}  // namespace

class VirtualDaemon::Parts {
 public:
  explicit Parts(VirtualOptions wanted) : options(std::move(wanted)), random(options.seed) {}

  void run(double until_s);

  VirtualOptions options;
  std::vector<std::unique_ptr<VirtualStreamContext>> contexts;
  std::vector<VirtualSource> sources;
  std::vector<VirtualCommand> script;
  std::vector<pipeline::Ack> acks_taken;
  std::size_t acked = 0;  // how many Acks there were
  std::unique_ptr<VirtualBodies> bodies;
  std::uint64_t write_errors = 0;  // of the log, until it was closed

 private:
  enum Part : std::uint8_t {
    kReader,
    kWorker,
    kPublisher,
    kLogWriter,
    kPerson,
    kSupervisor,
    kBuilder,
    kParts
  };

  void open();
  void open_log();
  void take_turn(Part part);
  [[nodiscard]] std::int64_t due_ns(Part part) const;
  void publish(int most);
  void publish_frame(PublishedStream& stream, const pipeline::Item& item);
  void speak(const VirtualCommand& command, std::uint64_t ticket);
  void keep_devices();
  void run_beside_builder();
  void write_log();
  void sleep();
  void look();
  void stop();
  void kill();
  std::int64_t draw_ns(std::int64_t most_ns) {
    return std::uniform_int_distribution<std::int64_t>(0, most_ns)(random);
  }

  std::mt19937_64 random;
  std::unique_ptr<record::RecordRings> record_sink;
  std::unique_ptr<record::LogWriterLoop> log_writer;
  std::unique_ptr<pipeline::Ring<pipeline::Item>> decoded, finished;
  std::unique_ptr<pipeline::Ring<pipeline::Command>> commands;
  std::unique_ptr<pipeline::Ring<pipeline::DeviceCommand>> device_commands;
  std::unique_ptr<pipeline::Ring<pipeline::Ack>> acks;
  std::unique_ptr<system::EventFd> pipeline_wake, publisher_wake;
  std::unique_ptr<pipeline::Worker> worker;
  std::unique_ptr<pipeline::Reader> reader;
  std::int64_t next_look_ns = kVirtualBegin_ns;
  std::size_t next_command = 0;
  std::size_t unsent = 0;                            // commands for a body that had no stream
  std::array<std::int64_t, kParts> due{};            // as returned by the part's last turn
  std::array<std::int64_t, kParts> held_until_ns{};  // no turn before this time
};

void VirtualDaemon::Parts::open_log() {
  if (options.log.empty()) return;
  const record::RecordedSetup setup = bodies->setup();
  record::RecorderOptions recorder;
  recorder.file = options.log;
  recorder.clock = virtual_clock;
  log::Writer writer = record::log_writer(recorder, setup);
  REQUIRE(writer.resume());
  record_sink = std::make_unique<record::RecordRings>(record::RingSizes{
      .chunk_bytes = std::vector<std::size_t>(setup.sources.size(), options.chunk_bytes),
      .slots = std::vector<record::SlotSizes>(setup.slots, options.record_slot)});
  log_writer = std::make_unique<record::LogWriterLoop>(*record_sink, std::move(writer), options.log,
                                                       [](const record::RecorderEvent&) {});
}

void VirtualDaemon::Parts::open() {
  virtual_now_ns = kVirtualBegin_ns;
  bodies = std::make_unique<VirtualBodies>(contexts, std::move(sources), options.bodies,
                                           options.max_made, !options.counts_only);
  open_log();
  const std::size_t slots = pipeline::kEventSlots + bodies->all_slots();
  decoded = std::make_unique<pipeline::Ring<pipeline::Item>>(slots);
  finished = std::make_unique<pipeline::Ring<pipeline::Item>>(slots);
  commands = std::make_unique<pipeline::Ring<pipeline::Command>>(pipeline::kMaxUnderWay);
  device_commands =
      std::make_unique<pipeline::Ring<pipeline::DeviceCommand>>(pipeline::kMaxUnderWay);
  acks = std::make_unique<pipeline::Ring<pipeline::Ack>>(options.ack_slots);
  pipeline_wake = system::EventFd::open().value();
  publisher_wake = system::EventFd::open().value();
  worker = pipeline::Worker::open({.in = decoded.get(),
                                   .out = finished.get(),
                                   .commands = commands.get(),
                                   .acks = acks.get(),
                                   .wake = pipeline_wake.get(),
                                   .publisher = publisher_wake.get(),
                                   .streams = &bodies->exchange(),
                                   .record_sink = record_sink.get(),
                                   .clock = virtual_clock})
               .value();
  reader = pipeline::Reader::open({.out = decoded.get(),
                                   .pipeline = pipeline_wake.get(),
                                   .record_sink = record_sink.get(),
                                   .clock = virtual_clock,
                                   .commands = device_commands.get()})
               .value();
  bodies->start(*worker, *reader, record_sink.get(), [this] { run_beside_builder(); });
  std::ranges::stable_sort(script, {}, &VirtualCommand::at_s);
  reader->begin();
  due.fill(kVirtualBegin_ns);
  held_until_ns.fill(kVirtualBegin_ns);
}

// Runs one turn of a part that is due, drawn at random, then of another; else time advances.
void VirtualDaemon::Parts::run(double until_s) {
  open();
  const std::int64_t until_ns = std::min(at_ns(until_s), at_ns(options.killed_at_s));
  while (virtual_now_ns < until_ns) {
    if (within(options.asleep)) sleep();
    look();
    std::array<Part, kParts> ready{};
    std::size_t count = 0;
    std::int64_t next_ns = until_ns;
    for (int i = 0; i < kParts; ++i) {
      const auto part = static_cast<Part>(i);
      const std::int64_t at = std::max(due_ns(part), held_until_ns[part]);
      if (at <= virtual_now_ns) ready[count++] = part;
      next_ns = std::min(next_ns, at);
    }
    if (count == 0) {
      virtual_now_ns = next_ns;
      continue;
    }
    const Part part = ready[static_cast<std::size_t>(draw_ns(static_cast<int>(count) - 1))];
    take_turn(part);
    virtual_now_ns += 1 + draw_ns(static_cast<std::int64_t>(options.turn_us * 1e3));
    if (options.holdups && virtual_now_ns < at_ns(options.calm_from_s) &&
        draw_ns(options.turns_between_holdups) == 0) {
      held_until_ns[part] = virtual_now_ns + draw_ns(kMaxHoldup_ns);
    }
  }
  if (virtual_now_ns < at_ns(options.killed_at_s)) return stop();
  kill();
}

void VirtualDaemon::Parts::look() {
  if (!options.look || virtual_now_ns < next_look_ns) return;
  options.look(seconds(virtual_now_ns - kVirtualBegin_ns));
  next_look_ns += nanoseconds(options.look_every_s);
}

void VirtualDaemon::Parts::sleep() {
  for (const Spell& spell : options.asleep) {
    if (at_ns(spell.from_s) > virtual_now_ns) continue;
    virtual_now_ns = std::max(virtual_now_ns, at_ns(spell.until_s));
  }
}

// When a part would wake: at the time it asked for, or because one of its rings has something.
std::int64_t VirtualDaemon::Parts::due_ns(Part part) const {
  std::int64_t at = due[part];
  switch (part) {
    case kReader:
      if (!device_commands->empty()) at = virtual_now_ns;
      if (bodies->reader_is_called()) at = virtual_now_ns;
      break;
    case kWorker:
      if (!decoded->empty() || !commands->empty()) at = virtual_now_ns;
      break;
    case kPublisher:
      at = finished->empty() && acks->empty() ? system::kForever_ns : virtual_now_ns;
      break;
    case kPerson:
      at = next_command < script.size() ? at_ns(script[next_command].at_s) : system::kForever_ns;
      break;
    case kSupervisor:
      at = bodies->supervisor_due_ns();
      break;
    case kBuilder:
      at = bodies->due_ns();
      break;
    default:
      break;
  }
  return at;
}

void VirtualDaemon::Parts::take_turn(Part part) {
  switch (part) {
    case kReader:
      due[part] = reader->turn(virtual_now_ns);
      break;
    case kWorker:
      due[part] = worker->turn(virtual_now_ns);
      break;
    case kPublisher:
      publish(kItemsPublishedATurn);
      break;
    case kLogWriter:
      if (log_writer) write_log();
      due[part] = virtual_now_ns + kLogWriterEvery_ns;
      break;
    case kPerson:
      // Control sends at most kMaxUnderWay commands.
      if (next_command - unsent - acked < pipeline::kMaxUnderWay) {
        speak(script[next_command], next_command + 1);
        ++next_command;
      }
      break;
    case kBuilder:
      bodies->turn();
      break;
    default:
      keep_devices();
  }
}

void VirtualDaemon::Parts::write_log() {
  std::optional<FileLimit> full;
  if (within(options.disk_full)) full.emplace(0);
  log_writer->turn(virtual_now_ns);
  write_errors = log_writer->errors();
}

void VirtualDaemon::Parts::keep_devices() { bodies->supervise(); }

// A model takes its time to be read and bound, and the hot threads do not wait for it.
void VirtualDaemon::Parts::run_beside_builder() {
  for (std::int64_t i = draw_ns(3); i > 0; --i) {
    virtual_now_ns += draw_ns(kMaxStep_ns);
    for (const Part part : {kReader, kWorker, kPublisher}) {
      if (std::max(due_ns(part), held_until_ns[part]) <= virtual_now_ns) take_turn(part);
    }
  }
}

void VirtualDaemon::Parts::speak(const VirtualCommand& wanted, std::uint64_t ticket) {
  using Kind = VirtualCommand::Kind;
  if (!wanted.body.empty()) {
    const auto stream = bodies->stream_of(wanted.body);
    if (!stream) {
      ++unsent;
    } else {
      REQUIRE(commands->push(alpha_command(*stream, wanted.alpha, ticket)));
    }
    return;
  }
  VirtualStreamContext& context = *contexts[wanted.stream];
  if (wanted.kind == Kind::kCalibrate) {
    REQUIRE(device_commands->push({.kind = pipeline::DeviceCommand::Kind::kCalibrate,
                                   .source = wanted.stream,
                                   .ticket = ticket,
                                   .calibration = context.compile(wanted.bytes)}));
    return reader->call();
  }
  pipeline::Command command;
  switch (wanted.kind) {
    case Kind::kModel: {
      const auto stage =
          control::stage_for_model(context.stream.settings, bytes_of(wanted.bytes), "virtual");
      REQUIRE(stage);
      command = model_command(wanted.stream, *context.stream.settings.stages[*stage].type,
                              context.bind(*stage, wanted.bytes));
      const std::string hash = log::sha256_hex(bytes_of(wanted.bytes));
      hash.copy(command.model_hash.data(), hash.size());
      if (record_sink) record_sink->keep_model(bytes_of(wanted.bytes));
      break;
    }
    case Kind::kPlay: {
      const auto* gestures = static_cast<const generate::BoundModel*>(context.any_model());
      const auto order = gesture::make_play_order(
          gestures->gesture(), gesture::split_labels(wanted.labels), 1.0, wanted.loop);
      REQUIRE(order);
      command = play_command(wanted.stream, *order);
      break;
    }
    case Kind::kStopPlaying:
      command = stop_playing_command(wanted.stream);
      break;
    default:
      command = alpha_command(wanted.stream, wanted.alpha);
      break;
  }
  command.ticket = ticket;
  REQUIRE(commands->push(command));
}

void VirtualDaemon::Parts::publish(int most) {
  const auto publish_one = [this](const pipeline::Item& item) {
    using Kind = pipeline::Item::Kind;
    PublishedStream& stream = bodies->find(pipeline::stream_of(item));
    pipeline::count(stream.counters.publisher.taken);
    switch (item.kind) {
      case Kind::kSample:
        ++stream.published.samples;
        break;
      case Kind::kEvent:
        if (item.stream_event.kind == v1::Event::KIND_SHED) {
          stream.published.missed += static_cast<std::uint64_t>(item.stream_event.value);
        }
        if (item.stream_event.kind == v1::Event::KIND_ENDED) bodies->publish_end(stream);
        break;
      default:
        publish_frame(stream, item);
    }
  };
  for (int i = 0; i < most && finished->consume(publish_one); ++i) {
  }
  const auto count_ack = [this](const pipeline::Ack& ack) {
    ++acked;
    if (!options.counts_only) acks_taken.push_back(ack);
  };
  while (acks->consume(count_ack)) {
  }
}

void VirtualDaemon::Parts::publish_frame(PublishedStream& stream, const pipeline::Item& item) {
  const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
  stream.count(item.frame, raw, !options.counts_only);
  if (!record_sink) return;
  const std::string bytes =
      (raw ? stream.raw : stream.styled).encode(item.frame).SerializeAsString();
  record_sink->published(stream.id, item.frame.header.sequence, raw, bytes_of(bytes));
}

// In the order in which the daemon ends: from the devices to the log.
void VirtualDaemon::Parts::stop() {
  worker->finish();
  while (!finished->empty() || !acks->empty()) publish(kItemsPublishedATurn);
  if (log_writer) REQUIRE(log_writer->finish(virtual_now_ns));
  bodies->finish();
}

// To close the log would complete it, so its files are put back as they were.
void VirtualDaemon::Parts::kill() {
  const TempFolder folder;
  const auto copy = folder.path() / "log";
  if (log_writer) copy_log(options.log, copy);
  log_writer.reset();
  if (!options.log.empty()) copy_log(copy, options.log);
  bodies->finish();
}

VirtualDaemon::VirtualDaemon(VirtualOptions options)
    : parts_(std::make_unique<Parts>(std::move(options))) {}
VirtualDaemon::~VirtualDaemon() = default;

void VirtualDaemon::add(VirtualStream stream) {
  parts_->contexts.push_back(std::make_unique<VirtualStreamContext>(std::move(stream)));
}
void VirtualDaemon::add(VirtualSource source) { parts_->sources.push_back(std::move(source)); }
void VirtualDaemon::command(VirtualCommand command) {
  parts_->script.push_back(std::move(command));
}
void VirtualDaemon::run(double until_s) { parts_->run(until_s); }

VirtualDaemon::Published& VirtualDaemon::Published::operator+=(const Published& next) {
  frames += next.frames;
  raw += next.raw;
  samples += next.samples;
  newest = std::max(newest, next.newest);
  numbers += next.numbers;
  missed += next.missed;
  sequences.insert(sequences.end(), next.sequences.begin(), next.sequences.end());
  at_s.insert(at_s.end(), next.at_s.begin(), next.at_s.end());
  root_z_m.insert(next.root_z_m.begin(), next.root_z_m.end());
  return *this;
}

VirtualDaemon::Published VirtualDaemon::published(std::uint32_t stream) const {
  return parts_->bodies->published(stream);
}
const pipeline::StreamCounters& VirtualDaemon::counters(std::uint32_t stream) const {
  return parts_->bodies->counters_of(stream);
}
const std::vector<VirtualBody>& VirtualDaemon::bodies() const { return parts_->bodies->log(); }
std::size_t VirtualDaemon::warnings() const { return parts_->bodies->warnings(); }
std::uint64_t VirtualDaemon::write_errors() const { return parts_->write_errors; }
const std::vector<pipeline::Ack>& VirtualDaemon::acks() const { return parts_->acks_taken; }

}  // namespace posed::test
