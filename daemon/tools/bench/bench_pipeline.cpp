// `posed bench pipeline`: what the daemon adds to a bare ZeroMQ hop, from the reader's arrival
// stamp to another process. The two alternate every second, on the same frames.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "daemon/system/thread_time.hpp"
#include "daemon/tools/bench/bench_parts.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/report/plot.hpp"
#include "proto/message/frame_message.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::tools {
namespace {

// By the threads' names; threads of one name are summed up. Empty where the kernel does not count.
using TimesByThread = std::map<std::string, system::ThreadTime>;

TimesByThread thread_times() {
  TimesByThread times;
  std::error_code ignored;  // a thread may end meanwhile
  for (std::filesystem::directory_iterator task("/proc/self/task", ignored), end;
       !ignored && task != end; task.increment(ignored)) {
    std::string name;
    const auto time = system::time_of_thread(std::stoi(task->path().filename()));
    if (time && std::getline(std::ifstream(task->path() / "comm"), name)) times[name] += *time;
  }
  return times;
}

// Adds what passed from `before` to `after` to `sum`.
void add_passed(const TimesByThread& before, const TimesByThread& after, TimesByThread& sum) {
  for (const auto& [name, now] : after) {
    const auto found = before.find(name);
    sum[name] += now - (found == before.end() ? system::ThreadTime{} : found->second);
  }
}

// What the threads did for each frame.
struct ThreadShare {
  std::string name;
  double ran_us = 0.0, waited_us = 0.0;  // on a core; ready, but without one
  double turns = 0.0;                    // how often it was put on a core
};

// Where the time between the arrival of a pose and its receipt by a subscriber goes: the parts of
// the way, and the daemon's threads (daemon/HOP.md).
struct HopParts {
  HopFigures decode;     // in the reader, from its arrival stamp on
  HopFigures stages;     // in the pipeline
  HopFigures hand_over;  // from one thread to the next, twice, and the publisher's encoding
  HopFigures socket;     // from the publisher through ZeroMQ to the subscriber
  std::vector<ThreadShare> threads;

  // What one thread fewer would save of the median at most: one of the two hand-overs.
  [[nodiscard]] double one_thread_fewer_us() const { return hand_over.p50_us / 2.0; }
};

constexpr double kMinShare_us = 0.1;  // a frame: threads that do less are left out

std::vector<ThreadShare> shares_of(const TimesByThread& times, std::size_t frames) {
  std::vector<ThreadShare> shares;
  const auto each = static_cast<double>(std::max<std::size_t>(frames, 1));
  for (const auto& [name, time] : times) {
    const ThreadShare share{.name = name,
                            .ran_us = static_cast<double>(time.ran_ns) * 1e-3 / each,
                            .waited_us = static_cast<double>(time.waited_ns) * 1e-3 / each,
                            .turns = static_cast<double>(time.turns) / each};
    if (share.ran_us + share.waited_us >= kMinShare_us) shares.push_back(share);
  }
  std::ranges::sort(shares, std::ranges::greater{}, &ThreadShare::ran_us);
  return shares;
}

// Of the poses that arrived in [start_ns, end_ns); `times`: of the daemon's threads meanwhile.
HopParts hop_parts(std::span<const Arrival> arrivals, std::int64_t start_ns, std::int64_t end_ns,
                   const TimesByThread& times) {
  std::vector<double> decode, stages, hand_over, socket;
  const auto add = [](std::vector<double>& part, std::int64_t time_ns) {
    part.push_back(static_cast<double>(time_ns) * 1e-3);
  };
  for (const Arrival& arrival : arrivals) {
    if (arrival.bare || arrival.arrival_ns < start_ns || arrival.arrival_ns >= end_ns) continue;
    add(decode, arrival.decoded_ns);
    add(stages, arrival.stages_ns);
    add(hand_over, arrival.sent_ns - arrival.decoded_ns - arrival.stages_ns);
    add(socket, arrival.age_ns - arrival.sent_ns);
  }
  auto shares = shares_of(times, decode.size());
  return {.decode = figures_of(std::move(decode)),
          .stages = figures_of(std::move(stages)),
          .hand_over = figures_of(std::move(hand_over)),
          .socket = figures_of(std::move(socket)),
          .threads = std::move(shares)};
}

Findings findings_of(const HopParts& parts) {
  std::vector<Findings> threads;
  threads.reserve(parts.threads.size());
  for (const ThreadShare& thread : parts.threads) {
    threads.push_back(Findings()
                          .add("thread", thread.name)
                          .add("ran_us", thread.ran_us)
                          .add("waited_us", thread.waited_us)
                          .add("turns", thread.turns)
                          .say(fmt::format("{:<16} {:9.1f} {:9.1f} {:9.2f}", thread.name,
                                           thread.ran_us, thread.waited_us, thread.turns)));
  }
  return Findings()
      .say("the pipeline's way in parts:")
      .say(hop_heading())
      .add("decode", findings_of(parts.decode, "decode"))
      .add("stages", findings_of(parts.stages, "stages"))
      .add("hand_over", findings_of(parts.hand_over, "hand-over"))
      .add("socket", findings_of(parts.socket, "socket"))
      .add("one_thread_fewer_us", parts.one_thread_fewer_us())
      .say(fmt::format("one thread fewer would save at most {:.1f} us of the median",
                       parts.one_thread_fewer_us()))
      .say(fmt::format("{:<16} {:>9} {:>9} {:>9}   a frame", "thread", "ran us", "waits us",
                       "turns"))
      .add("threads_per_frame", threads);
}

// Bars of the four percentiles of some distributions, and a table of them.
report::Figure percentile_bars(const std::string& title, const std::string& sentence,
                               const std::string& quantity,
                               const std::vector<std::pair<std::string, HopFigures>>& peers) {
  report::Bars bars{.quantity = quantity,
                    .unit = "us, logarithmic",
                    .series = {},
                    .groups = {{"half are below (p50)", {}},
                               {"99 % are below", {}},
                               {"99.9 % are below", {}},
                               {"the longest", {}}},
                    .logarithmic = true};
  report::Table table{
      .columns = {{"", false}, {"p50 [us]"}, {"p99 [us]"}, {"p99.9 [us]"}, {"max [us]"}},
      .rows = {}};
  for (const auto& [name, figures] : peers) {
    bars.series.push_back(name);
    table.rows.push_back({name});
    const double percentiles[]{figures.p50_us, figures.p99_us, figures.p999_us, figures.max_us};
    for (std::size_t i = 0; i < bars.groups.size(); ++i) {
      bars.groups[i].values.push_back(percentiles[i]);
      table.rows.back().push_back(report::number_text(percentiles[i], 1));
    }
  }
  report::Figure figure = report::bars_figure(title, sentence, bars);
  figure.tables.push_back(std::move(table));
  return figure;
}

report::Figure bars_of(const std::vector<ThreadShare>& threads) {
  report::Bars bars{.quantity = "time for each frame",
                    .unit = "us",
                    .series = {"on a core", "ready, waiting for a core"},
                    .groups = {}};
  for (const ThreadShare& thread : threads) {
    bars.groups.push_back({thread.name, {thread.ran_us, thread.waited_us}});
  }
  return report::bars_figure("What the daemon's threads did for each frame",
                             "A thread that waits was ready, but other threads or programs had "
                             "the cores: that part is the scheduler's.",
                             bars);
}

constexpr double kRate_hz = kWalkers_hz;
constexpr double kMaxPressure_percent = 5.0;  // of others, above which nothing counts
constexpr int kWarmUp_s = 2;                  // the first turn of each is not counted
constexpr const char* kBenchPipelineFooter =
    R"(Synthetic walkers at 120 Hz through the real daemon: file driver, rings, a style model of
--points poses, publisher; no recording. Every other second the reader sends
a message of the same size straight to ZeroMQ instead: the bare hop. The subscriber is another
process. The result is valid only if the CPU pressure (PSI some) stays below 5 %.

  posed bench pipeline
  posed bench pipeline --streams 32 --points 200 --json
  posed bench pipeline --report hop.html)";

struct HopOptions {
  int streams = 1;
  int points = 1000;
  int seconds = 60;
  bool gate = false;
  bool realtime = false;
  ReportFile report;
  bool json = false;
};

// The bare hop: the reader thread sends directly during its seconds.
class BareHop {
 public:
  BareHop(net::Socket socket, std::string endpoint, std::string body)
      : socket_(std::move(socket)), endpoint_(std::move(endpoint)), body_(std::move(body)) {}

  static Result<std::unique_ptr<BareHop>> open(void* context, int streams, std::string body) {
    auto socket = TRY(net::open_socket(context, ZMQ_PUB));
    TRY(publish::set_queue_options(socket.get(), kRate_hz * streams));
    auto endpoint = TRY(net::bind_socket(socket.get(), "tcp://127.0.0.1:*"));
    return std::make_unique<BareHop>(std::move(socket), std::move(endpoint), std::move(body));
  }

  void send(std::int64_t arrival_ns) noexcept {
    std::memcpy(body_.data(), &arrival_ns, sizeof arrival_ns);
    static_cast<void>(net::send_part(socket_.get(), "bare/walker", true) &&
                      net::send_part(socket_.get(), body_, false));
  }
  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

 private:
  net::Socket socket_;
  std::string endpoint_;
  std::string body_;
};

// Which second it is: the pipeline has the even ones.
struct Turns {
  std::int64_t start_ns = 0;
  [[nodiscard]] bool bare(std::int64_t time_ns) const noexcept {
    return (time_ns - start_ns) / kNanosPerSecond % 2 != 0;
  }
};

class TurnDecoder final : public drivers::Decoder {
 public:
  TurnDecoder(std::unique_ptr<drivers::Decoder> inner, BareHop& hop, const Turns& turns)
      : inner_(std::move(inner)), hop_(hop), turns_(turns) {}
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override {
    if (turns_.bare(arrival_ns)) return hop_.send(arrival_ns);
    inner_->feed(bytes, arrival_ns, sink);
  }

 private:
  std::unique_ptr<drivers::Decoder> inner_;
  BareHop& hop_;
  const Turns& turns_;
};

// Starts a little later, so that streams of one rate are not all due at the same instant.
class LaterTransport final : public drivers::Transport {
 public:
  LaterTransport(std::unique_ptr<drivers::Transport> inner, std::int64_t later_ns)
      : inner_(std::move(inner)), later_ns_(later_ns) {}
  [[nodiscard]] int poll_fd() const noexcept override { return inner_->poll_fd(); }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override { return inner_->next_due_ns(); }
  [[nodiscard]] double rate_hz() const noexcept override { return inner_->rate_hz(); }
  Result<> start(std::int64_t now_ns) override { return inner_->start(now_ns + later_ns_); }
  [[nodiscard]] drivers::Chunk read(std::int64_t now_ns) noexcept override {
    return inner_->read(now_ns);
  }

 private:
  std::unique_ptr<drivers::Transport> inner_;
  std::int64_t later_ns_;
};

// Measurements of the process during the run.
struct Watched {
  double pipeline_cpu_percent = 0.0;  // of one core, in the pipeline's seconds
  std::uint64_t rss_10s = 0, rss_end = 0;
  std::uint64_t dropped = 0, shed = 0;
  double pressure_before_percent = 0.0, pressure_percent = 0.0;
  HopReport report;
  TimesByThread threads;  // in the pipeline's seconds
  HopParts parts;
  std::uint64_t gaps = 0;
};

// A serialized frame of the same size as the stream's.
std::string sample_body(const devices::OpenSource& source) {
  const Skeleton& skeleton = *source.device.description.skeleton;
  Frame frame;
  pose_from_channels(skeleton, std::vector<double>(skeleton.channels.size(), 0.1), frame);
  frame.header.sequence = frame.header.arrival_ns = system::monotonic_ns();
  frame.header.device_ns = frame.header.arrival_ns;
  message::FrameEncoder encoder(source.config.name);
  static_cast<void>(encoder.encode(frame));
  const std::int64_t some_ns = frame.header.arrival_ns;
  return encoder.stamp({some_ns, some_ns}, {}).SerializeAsString();
}

// Sleeps through all turns and samples the process at each change.
void watch(const assembly::Daemon& daemon, const Turns& turns, int seconds, Watched& watched) {
  std::int64_t pipeline_cpu_ns = 0;
  std::int64_t before_ns = system::cpu_time_ns();
  TimesByThread before = thread_times();
  for (int second = 0; second < seconds; ++second) {
    const std::int64_t until_ns = turns.start_ns + (second + 1) * kNanosPerSecond;
    std::this_thread::sleep_for(std::chrono::nanoseconds(until_ns - system::monotonic_ns()));
    const std::int64_t cpu_ns = system::cpu_time_ns();
    TimesByThread after = thread_times();
    if (second % 2 == 0) {
      pipeline_cpu_ns += cpu_ns - before_ns;
      if (second >= kWarmUp_s) add_passed(before, after, watched.threads);
    }
    before_ns = cpu_ns;
    before = std::move(after);
    watched.rss_end = system::resident_bytes();
    if (second < 10) watched.rss_10s = watched.rss_end;
  }
  const int measured_s = (seconds + 1) / 2;
  watched.pipeline_cpu_percent = static_cast<double>(pipeline_cpu_ns) * 1e-7 / measured_s;
  const v1::Stats stats = daemon.stats();
  for (const v1::StreamStats& stream : stats.stream()) {
    watched.dropped += stream.dropped();
    watched.shed += stream.shed();
  }
}

Result<Watched> measure(const HopOptions& options) {
  spdlog::set_level(spdlog::level::err);  // only the figures are to be printed
  auto subscriber = TRY(HopSubscriber::fork());
  const WorkFolder folder;
  auto config = TRY(walkers_config(
      {.streams = options.streams, .points = options.points, .gate = options.gate}, folder));
  // Each gets its turn every other second.
  for (config::StreamConfig& stream : config.streams) stream.stale_after_s = 3.0;
  config.realtime = options.realtime;
  auto daemon = TRY(assembly::Daemon::open(config));
  auto context = TRY(net::open_context());
  auto hop = TRY(BareHop::open(context.get(), options.streams, sample_body(*daemon->sources()[0])));
  Turns turns;
  int place = 0;
  for (const auto& source : daemon->sources()) {
    drivers::Device& device = source->device;
    device.decoder = std::make_unique<TurnDecoder>(std::move(device.decoder), *hop, turns);
    device.transport = std::make_unique<LaterTransport>(
        std::move(device.transport), nanoseconds(place++ / (kRate_hz * options.streams)));
  }
  turns.start_ns = system::monotonic_ns() + kNanosPerSecond / 2;
  TRY(daemon->start());
  subscriber->begin({daemon->publish_endpoint(), hop->endpoint()});
  Watched watched;
  watched.pressure_before_percent = cpu_pressure("avg10=");
  const double pressure_us = cpu_pressure("total=");
  const std::int64_t begun_ns = system::monotonic_ns();
  watch(*daemon, turns, options.seconds, watched);
  watched.pressure_percent =
      (cpu_pressure("total=") - pressure_us) / (seconds(system::monotonic_ns() - begun_ns) * 1e4);
  daemon->stop();
  auto arrivals = TRY(subscriber->finish());
  watched.gaps = arrivals.gaps;
  const std::int64_t end_ns = turns.start_ns + options.seconds * kNanosPerSecond;
  watched.report = report_hops(arrivals.messages, turns.start_ns, end_ns);
  watched.parts = hop_parts(arrivals.messages, turns.start_ns + kWarmUp_s * kNanosPerSecond, end_ns,
                            watched.threads);
  return watched;
}

bool too_busy(const Watched& watched) { return watched.pressure_percent > kMaxPressure_percent; }

Findings findings_of(const HopOptions& options, const Watched& watched) {
  const HopReport& report = watched.report;
  const double added_us = report.pipeline.p50_us - report.bare.p50_us;
  return Findings()
      .add("streams", options.streams)
      .add("points", options.points)
      .add("gate", options.gate)
      .add("realtime", options.realtime)
      .add("seconds", options.seconds)
      .say(fmt::format("{} stream(s) x {:.0f} Hz x GP of {} poses, {} s", options.streams, kRate_hz,
                       options.points, options.seconds))
      .say(hop_heading())
      .add("bare", findings_of(report.bare, "bare"))
      .add("pipeline", findings_of(report.pipeline, "pipeline"))
      .add("added_p50_us", added_us)
      .add("block_p50_ratio", report.block_p50_ratio)
      .add("block_p99_ratio", report.block_p99_ratio)
      .say(fmt::format(
          "p50 added {:.1f} us; median over 1-s block pairs: p50 ratio {:.2f}, p99 ratio {:.2f}",
          added_us, report.block_p50_ratio, report.block_p99_ratio))
      .add("parts", findings_of(watched.parts))
      .add("dropped", watched.dropped)
      .add("shed", watched.shed)
      .add("sequence_gaps", watched.gaps)
      .add("cpu_percent", watched.pipeline_cpu_percent)
      .say(fmt::format("dropped {}, shed {}, sequence gaps {}; CPU {:.1f} % of a core",
                       watched.dropped, watched.shed, watched.gaps, watched.pipeline_cpu_percent))
      .add("rss_10s_bytes", watched.rss_10s)
      .add("rss_end_bytes", watched.rss_end)
      .say(fmt::format("RSS {:.1f} MB at 10 s, {:.1f} MB at the end",
                       static_cast<double>(watched.rss_10s) * 1e-6,
                       static_cast<double>(watched.rss_end) * 1e-6))
      .add("psi_cpu_some_before_percent", watched.pressure_before_percent)
      .add("psi_cpu_some_percent", watched.pressure_percent)
      .say(fmt::format(
          "CPU pressure (PSI some): {:.1f} % in the 10 s before, {:.1f} % during the run{}",
          watched.pressure_before_percent, watched.pressure_percent,
          too_busy(watched) ? " - too busy: repeat on a quiet machine" : ""));
}

std::string pressure_words(const Watched& watched) {
  if (watched.pressure_percent < 0.0) return "; the kernel does not say how busy the CPU was";
  return fmt::format("; others kept the CPU busy for {:.1f} % of the time{}",
                     watched.pressure_percent,
                     too_busy(watched) ? ", too much: repeat on a quiet machine" : "");
}

Result<> write_bench_page(const HopOptions& options, const Watched& watched,
                          const Findings& findings) {
  if (!options.report.wanted()) return {};
  const HopReport& report = watched.report;
  const HopParts& parts = watched.parts;
  report::Page page("Measurement", "posed bench pipeline");
  page.verdict(fmt::format("at the median the daemon adds {:.0f} us to a bare hop{}",
                           report.pipeline.p50_us - report.bare.p50_us, pressure_words(watched)),
               !too_busy(watched));
  page.section("Distributions");
  page.add(percentile_bars(
      fmt::format("{} stream{} at {:.0f} Hz, {} poses in the style model", options.streams,
                  options.streams == 1 ? "" : "s", kRate_hz, options.points),
      "The second bar of a pair is what a frame needs through the whole daemon, the first what "
      "ZeroMQ needs alone: their distance is posed's part. Equal distances are equal factors.",
      "from the arrival to another process",
      {{"bare ZeroMQ hop", report.bare}, {"posed's pipeline", report.pipeline}}));
  page.add(percentile_bars(
      "The pipeline's way in parts",
      fmt::format("A frame is decoded in the reader, handed to the pipeline, changed by its "
                  "stages, handed to the publisher, and sent through ZeroMQ. A bare hop takes "
                  "{:.0f} us at the median. One thread fewer would save at most {:.0f} us of it.",
                  report.bare.p50_us, parts.one_thread_fewer_us()),
      "time of a frame in each part",
      {{"decoding", parts.decode},
       {"stages", parts.stages},
       {"two hand-overs, encoding", parts.hand_over},
       {"ZeroMQ to the subscriber", parts.socket}}));
  page.add(bars_of(parts.threads));
  add_numbers(findings, "`posed bench pipeline --help` explains them.", page);
  add_json(findings, page);
  return report::write_page(page, options.report.path);
}

Result<> bench_pipeline(const HopOptions& options) {
  TRY(options.report.check());
  const auto watched = TRY(measure(options));
  const Findings findings = findings_of(options, watched);
  findings.show(options.json);
  return write_bench_page(options, watched, findings);
}

}  // namespace

void add_bench(CLI::App& app, int& exit_code) {
  CLI::App* bench = app.add_subcommand("bench", "Measure what posed costs on this machine");
  bench->require_subcommand(1);
  CLI::App* command = bench->add_subcommand(
      "pipeline", "Arrival to receive in another process, against a bare ZeroMQ hop");
  auto options = std::make_shared<HopOptions>();
  command->add_option("--streams", options->streams, "Streams at 120 Hz")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_option("--points", options->points, "Poses in the style model")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "How long, both turns together")
      ->check(CLI::Range(4, 86400))
      ->capture_default_str();
  command->add_flag("--realtime", options->realtime, "Ask for real-time rights, as `run` does");
  command->add_flag("--gate", options->gate, "With the style's gate");
  add_report_file(*command, options->report);
  command->add_flag("--json", options->json, "JSON on stdout");
  command->footer(kBenchPipelineFooter);
  command->callback([options, &exit_code] { exit_code = report(bench_pipeline(*options)); });
}

}  // namespace posed::tools
