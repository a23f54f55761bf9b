#include "daemon/assembly/daemon.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include <spdlog/spdlog.h>

#include "daemon/assembly/output_threads.hpp"
#include "daemon/assembly/streams.hpp"
#include "daemon/control/control_server.hpp"
#include "daemon/control/trigger_server.hpp"
#include "daemon/metrics/metrics_server.hpp"
#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/worker.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/hot_cpu.hpp"
#include "daemon/system/realtime.hpp"
#include "daemon/teach/teacher.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::assembly {
namespace {

constexpr const char* kReaderName = "posed-reader";
constexpr const char* kPipelineName = "posed-pipeline";
constexpr const char* kPublisherName = "posed-publish";

}  // namespace

// How the reader, the pipeline and the publisher run: with real-time rights if these are wanted and
// granted, and then on one CPU while it has room for them (system/hot_cpu.hpp).
class HotThreads {
 public:
  // Asks the operating system for what is wanted; a refusal is only a warning.
  HotThreads(bool realtime, bool share_cpu) : realtime_(realtime && system::ask_for_realtime()) {
    if (realtime_ && share_cpu) cpu_ = system::HotCpu::open();
  }

  // Runs `run` in a thread of that name and, with real-time rights, of that priority.
  [[nodiscard]] std::thread start(const char* name, int priority, std::function<void()> run) {
    if (!realtime_) priority = 0;
    return std::thread([cpu = cpu_, name, priority, run = std::move(run)] {
      system::enter_hot_thread(name, priority);
      if (cpu) cpu->join(priority);
      run();
    });
  }

  // Call before the first of these threads ends.
  void ending() {
    if (cpu_) cpu_->stop();
  }

 private:
  bool realtime_;
  std::shared_ptr<system::HotCpu> cpu_;  // null: not wanted, or not possible
};

// Members are declared in the order of their construction; each uses only those before it.
class Daemon::Parts final : public control::DaemonControl {
 public:
  explicit Parts(const config::DaemonConfig& daemon_config) : config(daemon_config) {}
  ~Parts() override { halt(); }

  Result<> open();
  Result<> start(DaemonHooks wanted);
  void halt() noexcept;

  // DaemonControl, for the control thread.
  bool send(const pipeline::Command& command) override {
    const bool sent = commands->push(command);
    pipeline_wake->notify();
    return sent;
  }
  bool send(const pipeline::DeviceCommand& command) override {
    const bool sent = device_commands->push(command);
    reader->call();
    return sent;
  }
  void keep_model(std::span<const std::byte> bytes) override {
    if (hooks.record_sink != nullptr) hooks.record_sink->keep_model(bytes);
  }
  void stages_changed(std::uint32_t stream, const pipeline::StreamSettings& settings) override {
    publisher->set_stages(stream, publish::stage_infos(settings));
  }
  Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) override {
    if (hooks.record_sink != nullptr) return hooks.record_sink->mark_take(mark);
    return fail(
        "the daemon is not recording; start it with `posed record` or a [record] table in its"
        " config");
  }
  void fill(v1::Stats& stats) override { stats = publisher->stats(); }
  void add_clips(v1::ControlReply& reply) const override {
    if (hooks.add_clips) hooks.add_clips(reply);
  }
  void stop() override { stop_asked.store(true); }

  config::DaemonConfig config;
  DaemonHooks hooks;
  std::atomic<bool> stop_asked{false};

  net::Context context;
  std::unique_ptr<net::ZapAuthenticator> authenticator;
  std::string secret_z85;
  std::unique_ptr<system::EventFd> pipeline_wake, publisher_wake, control_wake;
  std::unique_ptr<pipeline::Ring<pipeline::Item>> decoded, finished;
  std::unique_ptr<pipeline::Ring<pipeline::Command>> commands;
  std::unique_ptr<pipeline::Ring<pipeline::DeviceCommand>> device_commands;
  std::unique_ptr<pipeline::Ring<pipeline::Ack>> acks;
  std::unique_ptr<Streams> streams;
  control::ModelFolder models;
  std::unique_ptr<teach::Teacher> teacher;           // null: there is no folder of models
  std::unique_ptr<control::RequestHandler> handler;  // owns the models
  std::unique_ptr<OutputThreads> outputs;
  std::unique_ptr<publish::Publisher> publisher;
  std::unique_ptr<pipeline::Worker> worker;
  std::unique_ptr<pipeline::Reader> reader;
  std::unique_ptr<control::ControlServer> control;
  std::unique_ptr<control::TriggerServer> trigger;  // null: the config has no [trigger]
  std::unique_ptr<metrics::MetricsServer> metrics;  // null: the config has no [metrics]
  std::unique_ptr<HotThreads> threads;
  std::thread publisher_thread, worker_thread, reader_thread;

 private:
  Result<> open_sockets();
  Result<> open_publisher();
  Result<> open_engines();
  Result<> start_threads();
  Result<> start_metrics();
  [[nodiscard]] metrics::Figures figures() const;
};

Result<> Daemon::Parts::open() {
  streams = TRY(Streams::open(config));
  const std::size_t into_pipeline = pipeline::kEventSlots + streams->decoded_slots();
  const std::size_t out_of_pipeline = pipeline::kEventSlots + streams->finished_slots();
  if (!config.sources.empty()) {
    spdlog::info(
        "room for {} streams at once: {:.0f} MB for what is on its way", streams->slots(),
        static_cast<double>((into_pipeline + out_of_pipeline) * sizeof(pipeline::Item)) / 1e6);
  }
  decoded = std::make_unique<pipeline::Ring<pipeline::Item>>(into_pipeline);
  finished = std::make_unique<pipeline::Ring<pipeline::Item>>(out_of_pipeline);
  commands = std::make_unique<pipeline::Ring<pipeline::Command>>(control::kMaxUnderWay);
  device_commands =
      std::make_unique<pipeline::Ring<pipeline::DeviceCommand>>(control::kMaxUnderWay);
  acks = std::make_unique<pipeline::Ring<pipeline::Ack>>(control::kMaxUnderWay);
  for (auto* wake : {&pipeline_wake, &publisher_wake, &control_wake}) {
    auto opened = TRY(system::EventFd::open());
    *wake = std::move(opened);
  }
  models = TRY(control::ModelFolder::open(config.models));
  return {};
}

Result<> Daemon::Parts::start(DaemonHooks wanted) {
  hooks = std::move(wanted);
  if (!config.models.empty()) {
    teacher = std::make_unique<teach::Teacher>(
        [this](teach::Subject subject, const std::string& name, std::string_view bytes) {
          return models.add(name, subject == teach::Subject::kSigns ? "generate" : "style", bytes);
        },
        [this] { control_wake->notify(); });
  }
  TRY(open_sockets());
  TRY(open_engines());
  return start_threads();
}

Result<> Daemon::Parts::open_sockets() {
  net::raise_file_limit();
  context = TRY(net::open_context());
  std::optional<net::AccessList> allowed;  // empty without keys
  if (!config.security.server_key.empty()) {
    auto keys = TRY(net::read_secret_key(config.security.server_key));
    secret_z85 = keys.secret_z85;
    allowed.emplace(config.security.clients);
  }
  authenticator = TRY(net::ZapAuthenticator::start(context.get(), std::move(allowed)));
  outputs = TRY(OutputThreads::open(config.outputs));
  return open_publisher();
}

Result<> Daemon::Parts::open_publisher() {
  publish::PublisherOptions options{.context = context.get(),
                                    .endpoint = config.publish_endpoint,
                                    .authenticator = authenticator.get(),
                                    .secret_z85 = secret_z85,
                                    .more_stats = hooks.more_stats,
                                    .record_sink = hooks.record_sink,
                                    .raw_tap = teacher.get(),
                                    .clock = system::monotonic_ns,
                                    .slots = streams->slots(),
                                    .messages_per_s = streams->messages_per_s(),
                                    .outputs = outputs->outputs()};
  for (const auto& source : streams->sources()) {
    if (!source->has_several()) continue;
    options.sources.push_back({.name = source->config.name,
                               .driver = source->config.driver,
                               .comes_and_goes = source->slot != nullptr,
                               .present = source->present,
                               .counters = &source->counters});
  }
  publisher = TRY(publish::Publisher::open(std::move(options), *finished, *publisher_wake));
  return {};
}

Result<> Daemon::Parts::open_engines() {
  worker = TRY(pipeline::Worker::open({.in = decoded.get(),
                                       .out = finished.get(),
                                       .commands = commands.get(),
                                       .acks = acks.get(),
                                       .wake = pipeline_wake.get(),
                                       .publisher = publisher_wake.get(),
                                       .control = control_wake.get(),
                                       .streams = &streams->exchange(),
                                       .record_sink = hooks.record_sink,
                                       .frame_tap = hooks.frame_tap,
                                       .clock = system::monotonic_ns}));
  reader = TRY(pipeline::Reader::open({.out = decoded.get(),
                                       .pipeline = pipeline_wake.get(),
                                       .record_sink = hooks.record_sink,
                                       .clock = system::monotonic_ns,
                                       .commands = device_commands.get()}));
  handler = std::make_unique<control::RequestHandler>(*this, streams->kept(), models,
                                                      system::monotonic_ns, teacher.get(),
                                                      control::RecordingFolder(config.recordings));
  streams->begin({.publisher = publisher.get(),
                  .handler = handler.get(),
                  .worker = worker.get(),
                  .reader = reader.get(),
                  .record = hooks.record_stream});
  return {};
}

Result<> Daemon::Parts::start_threads() {
  control = TRY(control::ControlServer::start(context.get(), config.control_endpoint,
                                              {.acks = acks.get(),
                                               .wake = control_wake.get(),
                                               .authenticator = authenticator.get(),
                                               .secret_z85 = secret_z85},
                                              *handler));
  if (config.trigger) {
    trigger =
        TRY(control::TriggerServer::start(config.trigger->listen, config.trigger->peers, *this));
  }
  TRY(start_metrics());
  outputs->start([this](std::optional<std::uint32_t> stream, const output::News& news) {
    if (!stream) {
      return spdlog::log(news.good ? spdlog::level::info : spdlog::level::warn, "{}", news.text);
    }
    const auto kind = news.good ? v1::Event::KIND_OUTPUT_WORKS : v1::Event::KIND_WARNING;
    publisher->post_event(*stream, kind, news.text);
  });
  threads = std::make_unique<HotThreads>(config.realtime, config.share_cpu);
  publisher_thread =
      threads->start(kPublisherName, system::kPublisherPriority, [this] { publisher->run(); });
  worker_thread = threads->start(kPipelineName, system::kPipelinePriority, [this] {
    if (hooks.hot_thread) hooks.hot_thread("pipeline");
    worker->run();
  });
  TRY(streams->start());
  reader_thread = threads->start(kReaderName, system::kReaderPriority, [this] {
    if (hooks.hot_thread) hooks.hot_thread("reader");
    reader->run();
  });
  return {};
}

Result<> Daemon::Parts::start_metrics() {
  if (!config.metrics) return {};
  metrics =
      TRY(metrics::MetricsServer::start(config.metrics->listen, [this] { return figures(); }));
  return {};
}

metrics::Figures Daemon::Parts::figures() const {
  const auto of = [](const net::PeerGuard& guard) {
    return metrics::SocketFigures{.peers = guard.peers(), .cuts = guard.cuts()};
  };
  metrics::Figures all{.stats = publisher->stats(),
                       .streams = publisher->figures(),
                       .publish = of(publisher->guard()),
                       .control = of(control->guard()),
                       .requests = control->counts()};
  if (hooks.recorder_figures) all.recorder = hooks.recorder_figures();
  return all;
}

// Stops the threads in the order of the data, from the devices to the clients, so that each still
// handles what the one before it made.
void Daemon::Parts::halt() noexcept {
  if (streams) streams->stop_supervisors();  // all at once, whatever they are waiting for
  if (threads) threads->ending();
  if (reader) reader->stop();
  if (reader_thread.joinable()) reader_thread.join();
  if (streams) streams->stop();
  if (worker) worker->stop();
  if (worker_thread.joinable()) worker_thread.join();
  metrics.reset();
  trigger.reset();
  control.reset();
  if (publisher) publisher->stop();
  if (publisher_thread.joinable()) publisher_thread.join();
  if (outputs) outputs->stop();
}

Daemon::Daemon(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Daemon::~Daemon() = default;

Result<std::unique_ptr<Daemon>> Daemon::open(const config::DaemonConfig& config) {
  auto parts = std::make_unique<Parts>(config);
  TRY(parts->open());
  return std::unique_ptr<Daemon>(new Daemon(std::move(parts)));
}

std::span<const std::unique_ptr<devices::OpenSource>> Daemon::sources() const noexcept {
  return parts_->streams->sources();
}
std::size_t Daemon::slots() const noexcept { return parts_->streams->slots(); }
std::vector<std::string> Daemon::stream_names() const { return parts_->streams->names(); }
Daemon::StreamCounts Daemon::stream_counts() const {
  const Streams::Counts counts = parts_->streams->counts();
  return {.live = counts.live, .all = counts.all};
}
Result<> Daemon::start(DaemonHooks hooks) { return parts_->start(std::move(hooks)); }
void Daemon::stop() noexcept { parts_->halt(); }
const std::string& Daemon::publish_endpoint() const noexcept {
  return parts_->publisher->endpoint();
}
const std::string& Daemon::control_endpoint() const noexcept { return parts_->control->endpoint(); }
std::string Daemon::metrics_url() const { return parts_->metrics ? parts_->metrics->url() : ""; }
bool Daemon::asked_to_stop() const noexcept { return parts_->stop_asked.load(); }
v1::Stats Daemon::stats() const { return parts_->publisher->stats(); }

bool Daemon::all_ended() const noexcept {
  bool any = false;
  for (const auto& source : parts_->streams->sources()) {
    if (source->endless) continue;
    any = true;
    // The only body of a device that can end has the slot of the source's number.
    const pipeline::StreamCounters& counters = parts_->streams->counters_of(source->number);
    if (counters.pipeline.state.load() != pipeline::StreamState::kEnded) return false;
  }
  return any;
}

bool Daemon::wants_keys() const noexcept { return !parts_->secret_z85.empty(); }

void Daemon::allow(const std::vector<net::AllowedClient>& clients) {
  if (parts_->authenticator->replace(net::AccessList(clients))) {
    parts_->publisher->check_subscribers();
  }
}

std::vector<system::ThreadPulse> Daemon::pulses() const {
  std::vector<system::ThreadPulse> all = parts_->outputs->pulses();
  all.push_back({.thread = kReaderName, .pulse = &parts_->reader->pulse()});
  all.push_back({.thread = kPipelineName, .pulse = &parts_->worker->pulse()});
  all.push_back({.thread = kPublisherName, .pulse = &parts_->publisher->pulse()});
  all.push_back(
      {.thread = control::ControlServer::kThreadName, .pulse = &parts_->control->pulse()});
  if (parts_->trigger) {
    all.push_back(
        {.thread = control::TriggerServer::kThreadName, .pulse = &parts_->trigger->pulse()});
  }
  if (parts_->metrics) {
    all.push_back(
        {.thread = metrics::MetricsServer::kThreadName, .pulse = &parts_->metrics->pulse()});
  }
  if (const system::Pulse* const pulse = parts_->streams->pulse()) {
    all.push_back({.thread = Streams::kThreadName, .pulse = pulse});
  }
  return all;
}

void Daemon::post_event(std::uint32_t stream, v1::Event::Kind kind, const std::string& text) {
  parts_->publisher->post_event(stream, kind, text);
}

}  // namespace posed::assembly
