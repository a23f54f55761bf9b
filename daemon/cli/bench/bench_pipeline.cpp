// `posed bench pipeline`: what the daemon adds to a bare ZeroMQ hop, from the reader's arrival
// stamp to another process. The two alternate every second, on the same frames.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <memory>
#include <string>
#include <thread>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/cli/bench/bench_parts.hpp"
#include "daemon/cli/bench/bench_report.hpp"
#include "daemon/cli/bench/hop_parts.hpp"
#include "daemon/cli/bench/hop_report.hpp"
#include "daemon/cli/bench/hop_subscriber.hpp"
#include "daemon/cli/cli.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "proto/message/frame_message.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::cli {
namespace {

constexpr double kRate_hz = kWalkers_hz;
constexpr int kWarmUp_s = 2;  // the first turn of each is not counted
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
    auto socket = net::open_socket(context, ZMQ_PUB);
    if (!socket) return std::unexpected(socket.error());
    if (auto set = publish::set_queue_options(socket->get(), kRate_hz * streams); !set) {
      return std::unexpected(set.error());
    }
    auto endpoint = net::bind_socket(socket->get(), "tcp://127.0.0.1:*");
    if (!endpoint) return std::unexpected(endpoint.error());
    return std::make_unique<BareHop>(std::move(*socket), std::move(*endpoint), std::move(body));
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
  [[nodiscard]] Result<> start(std::int64_t now_ns) override {
    return inner_->start(now_ns + later_ns_);
  }
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
  auto subscriber = HopSubscriber::fork();
  if (!subscriber) return std::unexpected(subscriber.error());
  const WorkFolder folder;
  auto config = walkers_config(
      {.streams = options.streams, .points = options.points, .gate = options.gate}, folder);
  if (!config) return std::unexpected(config.error());
  // Each gets its turn every other second.
  for (config::StreamConfig& stream : config->streams) stream.stale_after_s = 3.0;
  config->realtime = options.realtime;
  auto daemon = assembly::Daemon::open(*config);
  if (!daemon) return std::unexpected(daemon.error());
  auto context = net::open_context();
  if (!context) return std::unexpected(context.error());
  auto hop = BareHop::open(context->get(), options.streams, sample_body(*(*daemon)->sources()[0]));
  if (!hop) return std::unexpected(hop.error());
  Turns turns;
  int place = 0;
  for (const auto& source : (*daemon)->sources()) {
    drivers::Device& device = source->device;
    device.decoder = std::make_unique<TurnDecoder>(std::move(device.decoder), **hop, turns);
    device.transport = std::make_unique<LaterTransport>(
        std::move(device.transport), nanoseconds(place++ / (kRate_hz * options.streams)));
  }
  turns.start_ns = system::monotonic_ns() + kNanosPerSecond / 2;
  if (auto started = (*daemon)->start(); !started) return std::unexpected(started.error());
  (*subscriber)->begin({(*daemon)->publish_endpoint(), (*hop)->endpoint()});
  Watched watched;
  watched.pressure_before_percent = cpu_pressure("avg10=");
  const double pressure_us = cpu_pressure("total=");
  const std::int64_t begun_ns = system::monotonic_ns();
  watch(**daemon, turns, options.seconds, watched);
  watched.pressure_percent =
      (cpu_pressure("total=") - pressure_us) / (seconds(system::monotonic_ns() - begun_ns) * 1e4);
  (*daemon)->stop();
  auto arrivals = (*subscriber)->finish();
  if (!arrivals) return std::unexpected(arrivals.error());
  watched.gaps = arrivals->gaps;
  const std::int64_t end_ns = turns.start_ns + options.seconds * kNanosPerSecond;
  watched.report = report_hops(arrivals->messages, turns.start_ns, end_ns);
  watched.parts = hop_parts(arrivals->messages, turns.start_ns + kWarmUp_s * kNanosPerSecond,
                            end_ns, watched.threads);
  return watched;
}

nlohmann::ordered_json to_json(const HopOptions& options, const Watched& watched) {
  const HopReport& report = watched.report;
  return {{"streams", options.streams},
          {"points", options.points},
          {"gate", options.gate},
          {"realtime", options.realtime},
          {"seconds", options.seconds},
          {"bare", to_json(report.bare)},
          {"pipeline", to_json(report.pipeline)},
          {"added_p50_us", report.pipeline.p50_us - report.bare.p50_us},
          {"block_p50_ratio", report.block_p50_ratio},
          {"block_p99_ratio", report.block_p99_ratio},
          {"parts", to_json(watched.parts)},
          {"dropped", watched.dropped},
          {"shed", watched.shed},
          {"sequence_gaps", watched.gaps},
          {"cpu_percent", watched.pipeline_cpu_percent},
          {"rss_10s_bytes", watched.rss_10s},
          {"rss_end_bytes", watched.rss_end},
          {"psi_cpu_some_before_percent", watched.pressure_before_percent},
          {"psi_cpu_some_percent", watched.pressure_percent}};
}

void print(const HopOptions& options, const Watched& watched) {
  const HopReport& report = watched.report;
  std::printf("%d stream(s) x %.0f Hz x GP of %d poses, %d s\n", options.streams, kRate_hz,
              options.points, options.seconds);
  print_figures({{"bare", report.bare}, {"pipeline", report.pipeline}});
  std::printf("p50 added %.1f us; median over 1-s block pairs: p50 ratio %.2f, p99 ratio %.2f\n",
              report.pipeline.p50_us - report.bare.p50_us, report.block_p50_ratio,
              report.block_p99_ratio);
  print(watched.parts);
  std::printf("dropped %llu, shed %llu, sequence gaps %llu; CPU %.1f %% of a core\n",
              static_cast<unsigned long long>(watched.dropped),
              static_cast<unsigned long long>(watched.shed),
              static_cast<unsigned long long>(watched.gaps), watched.pipeline_cpu_percent);
  std::printf("RSS %.1f MB at 10 s, %.1f MB at the end\n",
              static_cast<double>(watched.rss_10s) * 1e-6,
              static_cast<double>(watched.rss_end) * 1e-6);
  std::printf("CPU pressure (PSI some): %.1f %% in the 10 s before, %.1f %% during the run%s\n",
              watched.pressure_before_percent, watched.pressure_percent,
              watched.pressure_percent > kMostPressure_percent
                  ? " - too busy: repeat on a quiet machine"
                  : "");
}

BenchPage page_of(const HopOptions& options, const Watched& watched) {
  const HopReport& report = watched.report;
  BenchPage page{
      .command = "posed bench pipeline",
      .verdict = fmt::format("at the median the daemon adds {:.0f} us to a bare hop{}",
                             report.pipeline.p50_us - report.bare.p50_us,
                             pressure_words(watched.pressure_percent)),
      .good = watched.pressure_percent <= kMostPressure_percent,
      .figures = {report::percentile_bars(
          {.title =
               fmt::format("{} stream{} at {:.0f} Hz, {} poses in the style model", options.streams,
                           options.streams == 1 ? "" : "s", kRate_hz, options.points),
           .sentence = "The second bar of a pair is what a frame needs through the whole "
                       "daemon, the first what ZeroMQ needs alone: their distance is posed's "
                       "part. Equal distances are equal factors.",
           .quantity = "from the arrival to another process",
           .peers = {{"bare ZeroMQ hop", percentiles_of(report.bare)},
                     {"posed's pipeline", percentiles_of(report.pipeline)}}})}};
  std::ranges::move(figures_of(watched.parts, report.bare.p50_us),
                    std::back_inserter(page.figures));
  return page;
}

Result<> bench_pipeline(const HopOptions& options) {
  if (auto checked = options.report.check(); !checked) return checked;
  const auto watched = measure(options);
  if (!watched) return std::unexpected(watched.error());
  return show_bench(
      options.json, to_json(options, *watched), [&] { print(options, *watched); },
      page_of(options, *watched), options.report);
}

}  // namespace

void add_bench_pipeline(CLI::App& bench, int& exit_code) {
  CLI::App* command = bench.add_subcommand(
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
  command->callback([options, &exit_code] {
    if (auto done = bench_pipeline(*options); !done) exit_code = report(done.error());
  });
}

}  // namespace posed::cli
