// `posed_bench relay`: what many subscribers behind a relay cost the daemon, against one that
// connects to it directly.
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/bench/bench_parts.hpp"
#include "daemon/tools/bench/child_process.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/relay/relay.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"

namespace posed::bench {
namespace {

constexpr const char* kBenchRelayFooter =
    R"(Synthetic walkers at 120 Hz through the real daemon, received in turn by one subscriber and
by a relay with --subscribers. Relay and subscribers are processes of their own that give way to the
daemon, as on other machines. CPU is the daemon's process alone; `send` is the time from a frame's
arrival to its hand-over to ZeroMQ. At the end subscribers that come late ask for a skeleton.

  posed_bench relay
  posed_bench relay --subscribers 50 --seconds 5 --json)";

constexpr int kLateJoiners = 20;
constexpr std::chrono::seconds kConnect{2};

struct RelayBench {
  int subscribers = 200;
  int streams = 1;
  int seconds = 10;
  int turns = 3;
  bool json = false;
};

// The processes of one turn, which wait until it comes.
struct Turn {
  std::unique_ptr<tools::HopSubscriber> direct;
  tools::ChildProcess relay;
  std::vector<std::unique_ptr<tools::HopSubscriber>> behind;
};

struct ReceivedFrames {
  double cpu_percent = 0.0;  // of one core, mean of the turns
  std::vector<double> send_us{};
  std::uint64_t gaps = 0;
};

struct RelayFigures {
  ReceivedFrames direct, relayed;
  std::vector<double> late_us;
};

int relay_until_stopped(tools::PipePair& parent) {
  spdlog::set_level(spdlog::level::err);
  auto context = net::open_context();
  if (!context) return 1;
  relay::RelayOptions options{.context = context->get(),
                              .from = {{.endpoint = parent.read_line()}},
                              .endpoint = "tcp://127.0.0.1:*"};
  const auto relay = relay::Relay::open(options);
  if (!relay || !parent.write_line((*relay)->endpoint())) return 1;
  // Every turn costs a system call that asks whether the parent has ended.
  zmq_pollitem_t ended{nullptr, parent.from(), ZMQ_POLLIN, 0};
  while (zmq_poll(&ended, 1, 0) == 0) {
    const std::int64_t now_ns = system::monotonic_ns();
    const std::int64_t due_ns = (*relay)->turn(now_ns);
    (*relay)->wait(std::min(due_ns - system::monotonic_ns(), kNanosPerSecond / 20));
  }
  return 0;
}

Result<std::vector<Turn>> fork_turns(const RelayBench& bench) {
  std::vector<Turn> turns;
  for (int i = 0; i < bench.turns; ++i) {
    auto direct = TRY(tools::HopSubscriber::fork(true));
    auto relay = TRY(tools::ChildProcess::fork(relay_until_stopped, true));
    Turn turn{std::move(direct), std::move(relay), {}};
    for (int s = 0; s < bench.subscribers; ++s) {
      auto behind = TRY(tools::HopSubscriber::fork(true));
      turn.behind.push_back(std::move(behind));
    }
    turns.push_back(std::move(turn));
  }
  return turns;
}

// Measures the daemon while all subscribers are there.
double cpu_percent_during(int seconds) {
  std::this_thread::sleep_for(kConnect);
  const tools::CpuShare cpu;
  std::this_thread::sleep_for(std::chrono::seconds(seconds));
  return cpu.percent();
}

Result<> collect(tools::HopSubscriber& subscriber, ReceivedFrames& frames, bool ages) {
  auto received = TRY(subscriber.finish());
  frames.gaps += received.gaps;
  if (!ages) return {};
  const std::vector<double> ages_us = send_ages_us(received.messages);
  frames.send_us.insert(frames.send_us.end(), ages_us.begin(), ages_us.end());
  return {};
}

// How long a subscriber that comes now waits for a skeleton.
Result<double> late_joiner_us(void* context, const std::string& endpoint) {
  auto socket = TRY(net::open_socket(context, ZMQ_SUB));
  TRY(net::set_option(socket.get(), ZMQ_SUBSCRIBE, std::string_view("skeleton/")));
  const std::int64_t begun_ns = system::monotonic_ns();
  TRY(net::connect_socket(socket.get(), endpoint));
  zmq_pollitem_t item{socket.get(), 0, ZMQ_POLLIN, 0};
  if (zmq_poll(&item, 1, 5000) != 1) return fail("no skeleton came within 5 s");
  return static_cast<double>(system::monotonic_ns() - begun_ns) * 1e-3;
}

Result<> measure_turn(const RelayBench& bench, const std::string& daemon, Turn& turn,
                      RelayFigures& figures) {
  turn.direct->begin({daemon});
  figures.direct.cpu_percent += cpu_percent_during(bench.seconds) / bench.turns;
  TRY(collect(*turn.direct, figures.direct, true));
  turn.relay.pipes().write_line(daemon);
  const std::string relay = turn.relay.pipes().read_line();
  if (relay.empty()) return fail("the relay's process ended early");
  for (const auto& subscriber : turn.behind) subscriber->begin({relay});
  figures.relayed.cpu_percent += cpu_percent_during(bench.seconds) / bench.turns;
  auto context = TRY(net::open_context());
  for (int i = 0; i < kLateJoiners; ++i) {
    const auto late_us = TRY(late_joiner_us(context.get(), relay));
    figures.late_us.push_back(late_us);
  }
  for (const auto& subscriber : turn.behind) {
    const bool first = subscriber == turn.behind.front();  // all hear the same stamps
    TRY(collect(*subscriber, figures.relayed, first));
  }
  turn.relay.pipes().close_to();
  return {};
}

Result<RelayFigures> measure(const RelayBench& bench) {
  spdlog::set_level(spdlog::level::err);  // only the figures are to be printed
  auto turns = TRY(fork_turns(bench));
  const tools::WorkFolder folder;
  const auto config = TRY(tools::walkers_config({.streams = bench.streams}, folder));
  auto daemon = TRY(assembly::Daemon::open(config));
  TRY(daemon->start());
  RelayFigures figures;
  for (Turn& turn : turns) {
    TRY(measure_turn(bench, daemon->publish_endpoint(), turn, figures));
  }
  daemon->stop();
  return figures;
}

tools::Findings findings_of(const ReceivedFrames& frames, const std::string& name) {
  return tools::Findings()
      .add("cpu_percent", frames.cpu_percent)
      .add("send", tools::findings_of(tools::figures_of(frames.send_us), name))
      .add("sequence_gaps", frames.gaps);
}

tools::Findings findings_of(const RelayBench& bench, const RelayFigures& figures) {
  const tools::HopFigures direct = tools::figures_of(figures.direct.send_us);
  const tools::HopFigures relayed = tools::figures_of(figures.relayed.send_us);
  const double cpu_ratio = figures.relayed.cpu_percent / figures.direct.cpu_percent;
  return tools::Findings()
      .add("subscribers", bench.subscribers)
      .add("streams", bench.streams)
      .add("seconds", bench.seconds)
      .add("turns", bench.turns)
      .say(fmt::format(
          "{} stream(s) x {:.0f} Hz, {} turns of {} s: 1 direct subscriber, then {} by a relay",
          bench.streams, tools::kWalkers_hz, bench.turns, bench.seconds, bench.subscribers))
      .say(tools::hop_heading())
      .add("direct", findings_of(figures.direct, "direct"))
      .add("relay", findings_of(figures.relayed, "relay"))
      .add("late_joiner", tools::findings_of(tools::figures_of(figures.late_us), "late"))
      .add("cpu_ratio", cpu_ratio)
      .say(
          fmt::format("daemon: CPU {:.2f} % and {:.2f} % of a core, ratio {:.2f}; send p50 {:.2f}, "
                      "p99 {:.2f}",
                      figures.direct.cpu_percent, figures.relayed.cpu_percent, cpu_ratio,
                      relayed.p50_us / direct.p50_us, relayed.p99_us / direct.p99_us))
      .say(fmt::format("sequence gaps: direct {}, behind the relay {}", figures.direct.gaps,
                       figures.relayed.gaps));
}

Result<> bench_relay(const RelayBench& bench) {
  const auto measured = TRY(measure(bench));
  findings_of(bench, measured).show(bench.json);
  return {};
}

}  // namespace

void add_bench_relay(CLI::App& bench, int& exit_code) {
  CLI::App* command =
      bench.add_subcommand("relay", "Many subscribers behind a relay, against one without");
  auto options = std::make_shared<RelayBench>();
  command->add_option("--subscribers", options->subscribers, "Behind the relay")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--streams", options->streams, "Streams at 120 Hz")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "How long each is measured in a turn")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str();
  command->add_option("--turns", options->turns, "How often both are measured")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_flag("--json", options->json, "JSON on stdout");
  command->footer(kBenchRelayFooter);
  command->callback([options, &exit_code] { exit_code = tools::report(bench_relay(*options)); });
}

}  // namespace posed::bench
