// `posed_bench stage`: performers whose poses come over UDP, each styled, published over ZeroMQ and
// sent to an avatar.
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "daemon/tools/bench/bench_parts.hpp"
#include "daemon/tools/bench/child_process.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"

namespace posed::bench {
namespace {

constexpr const char* kBenchStageFooter =
    R"(Emulated VMC performers send over UDP on loopback; the real daemon styles each with a model
of --points poses, publishes it and sends it to a VMC avatar. Emulators, subscriber and avatars are
processes of their own; CPU is the daemon's process alone. `send` is the time from the kernel's
receive stamp to the hand-over to ZeroMQ.

  posed_bench stage
  posed_bench stage --performers 64 --no-vmc --seconds 20)";

constexpr std::chrono::seconds kSettle{3};

struct StageBench {
  int performers = 16;
  int points = 200;
  double rate_hz = 120.0;
  int seconds = 60;
  bool no_vmc = false;
  bool realtime = false;
  bool json = false;
};

struct StageFigures {
  double cpu_percent = 0.0;  // of one core
  tools::HopFigures send;
  std::uint64_t frames = 0, gaps = 0, dropped = 0, shed = 0, kernel_dropped = 0;
  std::uint64_t sent_to_avatars = 0, avatars_received = 0, output_dropped = 0;
  std::uint64_t rss_bytes = 0;
  double pressure_percent = 0.0;
};

std::string address_of(int port) { return "127.0.0.1:" + std::to_string(port); }

// A UDP socket on a free port of this machine.
Result<int> open_udp(int& port) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (fd < 0 || bind(fd, any, size) != 0 || getsockname(fd, any, &size) != 0) {
    if (fd >= 0) close(fd);
    return fail("cannot open a UDP socket: " + errno_text());
  }
  port = ntohs(address.sin_port);
  return fd;
}

// Ports that are free now.
Result<std::vector<int>> free_ports(int count) {
  std::vector<int> ports(static_cast<std::size_t>(count)), fds;
  Result<> done;
  for (int& port : ports) {
    const auto fd = open_udp(port);
    if (!fd) done = std::unexpected(fd.error());
    if (fd) fds.push_back(*fd);
  }
  for (const int fd : fds) close(fd);
  if (!done) return std::unexpected(done.error());
  return ports;
}

// The child that performs: a thread for each performer, to the ports that the parent names.
int perform_until_stopped(tools::PipePair& parent, double rate_hz) {
  std::vector<std::unique_ptr<emulate::EmulatedDevice>> devices;
  for (std::string port; !(port = parent.read_line()).empty();) {
    auto emulator = drivers::find_driver("vmc")->emulate({{"rate_hz", rate_hz}});
    auto out = emulate::EmulatedPort::open_udp({port});
    if (!emulator || !out) return 1;
    devices.push_back(std::make_unique<emulate::EmulatedDevice>(
        std::move(*emulator), std::move(*out), emulate::Motion(),
        emulate::EmulatedDevice::Settings{}));
  }
  std::vector<std::jthread> threads;
  for (const auto& device : devices) {
    threads.emplace_back([&device](const std::stop_token& stop) { device->run(stop); });
    // Performers are not in step.
    std::this_thread::sleep_for(
        std::chrono::duration<double>(1.0 / rate_hz / static_cast<double>(devices.size())));
  }
  static_cast<void>(parent.read_line());  // until the parent closes
  return 0;
}

// The child that receives for all avatars at one port, which it writes first, and counts what
// comes.
int receive_of_avatars(tools::PipePair& parent) {
  int port = 0;
  const auto fd = open_udp(port);
  if (!fd || !parent.write_line(std::to_string(port))) return 1;
  std::atomic<std::uint64_t> received{0};
  std::jthread receiver([&received, fd = *fd](const std::stop_token& stop) {
    const timeval patience{.tv_sec = 0, .tv_usec = 100'000};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    std::array<char, 65536> bytes{};
    while (!stop.stop_requested()) {
      if (recv(fd, bytes.data(), bytes.size(), 0) > 0) ++received;
    }
  });
  static_cast<void>(parent.read_line());  // until the parent closes
  const std::uint64_t count = received;
  return parent.write(&count, sizeof count) ? 0 : 1;
}

Result<config::DaemonConfig> stage_config(const StageBench& bench, const std::vector<int>& ports,
                                          const std::string& avatars,
                                          const tools::WorkFolder& folder) {
  const auto walker = TRY(motion::make_walker({}));
  TRY(tools::write_synthetic_model(motion::Space::kHumanoid, *walker.skeleton, bench.points,
                                   folder / "model.style"));
  config::DaemonConfig config;
  config.publish_endpoint = config.control_endpoint = "tcp://127.0.0.1:*";
  config.realtime = bench.realtime;
  config.max_streams = bench.performers;
  const drivers::Driver& driver = *drivers::find_driver("vmc");
  const StageType& style = style::style_type();
  for (int i = 0; i < bench.performers; ++i) {
    auto options = complete_parameters(
        driver.options,
        {{"listen", address_of(ports[static_cast<std::size_t>(i)])}, {"rate_hz", bench.rate_hz}});
    auto parameters = complete_parameters(style.parameters, {});
    if (!options) return std::unexpected(options.error());
    if (!parameters) return std::unexpected(parameters.error());
    config::SourceConfig source;
    source.name = "p" + std::to_string(i);
    source.driver = driver.name;
    source.options = std::move(*options);
    source.rate_hz = bench.rate_hz;
    source.all = true;
    source.every.stages.push_back(
        {.type = &style, .parameters = std::move(*parameters), .model = folder / "model.style"});
    if (!bench.no_vmc) {
      config::OutputConfig output;
      output.name = "avatar" + std::to_string(i);
      output.body = source.name + "-performer";
      output.to = {avatars};
      config.outputs.push_back(std::move(output));
    }
    config.sources.push_back(std::move(source));
  }
  return config;
}

void count(const v1::Stats& stats, StageFigures& figures) {
  for (const v1::StreamStats& stream : stats.stream()) {
    figures.frames += stream.frames();
    figures.dropped += stream.dropped();
    figures.shed += stream.shed();
  }
  for (const v1::SourceStats& source : stats.source()) {
    figures.kernel_dropped += source.kernel_dropped();
  }
  for (const v1::OutputStats& output : stats.output()) {
    figures.sent_to_avatars += output.sent();
    figures.output_dropped += output.dropped();
  }
}

// Sleeps while the performers perform.
void watch(int seconds_, StageFigures& figures) {
  std::this_thread::sleep_for(kSettle);
  const tools::CpuShare cpu;
  const std::int64_t begun_ns = system::monotonic_ns();
  const double pressure_us = tools::cpu_pressure("total=");
  std::this_thread::sleep_for(std::chrono::seconds(seconds_));
  figures.cpu_percent = cpu.percent();
  figures.pressure_percent = (tools::cpu_pressure("total=") - pressure_us) /
                             (seconds(system::monotonic_ns() - begun_ns) * 1e4);
  figures.rss_bytes = system::resident_bytes();
}

Result<StageFigures> measure(const StageBench& bench) {
  spdlog::set_level(spdlog::level::err);  // only the figures are to be printed
  auto subscriber = TRY(tools::HopSubscriber::fork());
  auto performers = TRY(tools::ChildProcess::fork(
      [&bench](tools::PipePair& parent) { return perform_until_stopped(parent, bench.rate_hz); }));
  auto avatars = TRY(tools::ChildProcess::fork(receive_of_avatars));
  const tools::WorkFolder folder;
  const auto ports = TRY(free_ports(bench.performers));
  const std::string avatar_port = avatars.pipes().read_line();
  const auto config = TRY(stage_config(bench, ports, "127.0.0.1:" + avatar_port, folder));
  auto daemon = TRY(assembly::Daemon::open(config));
  TRY(daemon->start());
  subscriber->begin({daemon->publish_endpoint()});
  for (const int port : ports) performers.pipes().write_line(address_of(port));
  performers.pipes().write_line("");
  StageFigures figures;
  watch(bench.seconds, figures);
  performers.pipes().close_to();
  std::this_thread::sleep_for(kSettle);  // for the last statistics
  count(daemon->stats(), figures);
  daemon->stop();
  auto received = TRY(subscriber->finish());
  figures.gaps = received.gaps;
  figures.send = tools::figures_of(send_ages_us(received.messages));
  avatars.pipes().close_to();
  if (!avatars.pipes().read(&figures.avatars_received, sizeof figures.avatars_received)) {
    return fail("the avatars' process ended early");
  }
  return figures;
}

tools::Findings findings_of(const StageBench& bench, const StageFigures& figures) {
  tools::Findings findings;
  findings.add("performers", bench.performers)
      .add("points", bench.points)
      .add("rate_hz", bench.rate_hz)
      .add("seconds", bench.seconds)
      .add("vmc", !bench.no_vmc)
      .say(fmt::format("{} performers x {:.0f} Hz over UDP x GP of {} poses, {} s",
                       bench.performers, bench.rate_hz, bench.points, bench.seconds))
      .say(tools::hop_heading())
      .add("send", tools::findings_of(figures.send, "send"))
      .add("frames", figures.frames)
      .add("dropped", figures.dropped)
      .add("shed", figures.shed)
      .add("kernel_dropped", figures.kernel_dropped)
      .add("sequence_gaps", figures.gaps)
      .say(fmt::format("published {} frames; dropped {}, shed {}, by the kernel {}, gaps {}",
                       figures.frames, figures.dropped, figures.shed, figures.kernel_dropped,
                       figures.gaps))
      .add("vmc_sent", figures.sent_to_avatars)
      .add("vmc_heard", figures.avatars_received)
      .add("vmc_dropped", figures.output_dropped);
  if (!bench.no_vmc) {
    findings.say(fmt::format("avatars: {} datagrams sent, {} received, {} frames dropped",
                             figures.sent_to_avatars, figures.avatars_received,
                             figures.output_dropped));
  }
  return findings.add("cpu_percent", figures.cpu_percent)
      .add("rss_bytes", figures.rss_bytes)
      .add("psi_cpu_some_percent", figures.pressure_percent)
      .say(fmt::format("CPU {:.1f} % of a core, RSS {:.1f} MB; CPU pressure (PSI some) {:.1f} %",
                       figures.cpu_percent, static_cast<double>(figures.rss_bytes) * 1e-6,
                       figures.pressure_percent));
}

Result<> bench_stage(const StageBench& bench) {
  const auto measured = TRY(measure(bench));
  findings_of(bench, measured).show(bench.json);
  return {};
}

}  // namespace

void add_bench_stage(CLI::App& bench, int& exit_code) {
  CLI::App* command =
      bench.add_subcommand("stage", "Performers over UDP, styled, to ZeroMQ and to avatars");
  auto options = std::make_shared<StageBench>();
  command->add_option("--performers", options->performers, "How many")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_option("--points", options->points, "Poses in the style model")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz, "Frames per second of each")
      ->check(tools::in_range(10.0, 1000.0))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "How long it is measured")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  command->add_flag("--no-vmc", options->no_vmc, "Without avatars");
  command->add_flag("--realtime", options->realtime, "Ask for real-time rights, as `run` does");
  command->add_flag("--json", options->json, "JSON on stdout");
  command->footer(kBenchStageFooter);
  command->callback([options, &exit_code] { exit_code = tools::report(bench_stage(*options)); });
}

}  // namespace posed::bench
