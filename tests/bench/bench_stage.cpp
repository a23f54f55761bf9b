// `posed_bench stage`: performers whose poses come over UDP, each styled, published over ZeroMQ and
// sent to an avatar.
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "daemon/tools/bench/bench_parts.hpp"
#include "daemon/tools/bench/child_process.hpp"
#include "daemon/tools/bench/hop_subscriber.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/number_range.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "daemon/tools/emulate/emulated_port.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/style/style_type.hpp"

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
  HopFigures send;
  std::uint64_t frames = 0, gaps = 0, dropped = 0, shed = 0, kernel_dropped = 0;
  std::uint64_t sent_to_avatars = 0, avatars_heard = 0, output_dropped = 0;
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
int perform_until_stopped(PipePair& parent, double rate_hz) {
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

// The child that hears all avatars at one port, which it tells first, and counts what comes.
int hear_avatars(PipePair& parent) {
  int port = 0;
  const auto fd = open_udp(port);
  if (!fd || !parent.write_line(std::to_string(port))) return 1;
  std::atomic<std::uint64_t> heard{0};
  std::jthread ear([&heard, fd = *fd](const std::stop_token& stop) {
    const timeval patience{.tv_sec = 0, .tv_usec = 100'000};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    std::array<char, 65536> bytes{};
    while (!stop.stop_requested()) {
      if (recv(fd, bytes.data(), bytes.size(), 0) > 0) ++heard;
    }
  });
  static_cast<void>(parent.read_line());  // until the parent closes
  const std::uint64_t count = heard;
  return parent.write(&count, sizeof count) ? 0 : 1;
}

Result<config::DaemonConfig> stage_config(const StageBench& bench, const std::vector<int>& ports,
                                          const std::string& avatars, const WorkFolder& folder) {
  const auto walker = motion::make_walker({});
  if (!walker) return std::unexpected(walker.error());
  auto written = write_synthetic_model(motion::Space::kHumanoid, *walker->skeleton, bench.points,
                                       folder / "model.style");
  if (!written) return std::unexpected(written.error());
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
  const CpuShare cpu;
  const std::int64_t begun_ns = system::monotonic_ns();
  const double pressure_us = cpu_pressure("total=");
  std::this_thread::sleep_for(std::chrono::seconds(seconds_));
  figures.cpu_percent = cpu.percent();
  figures.pressure_percent =
      (cpu_pressure("total=") - pressure_us) / (seconds(system::monotonic_ns() - begun_ns) * 1e4);
  figures.rss_bytes = system::resident_bytes();
}

Result<StageFigures> measure(const StageBench& bench) {
  spdlog::set_level(spdlog::level::err);  // only the figures are to be printed
  auto subscriber = HopSubscriber::fork();
  if (!subscriber) return std::unexpected(subscriber.error());
  auto performers = ChildProcess::fork(
      [&bench](PipePair& parent) { return perform_until_stopped(parent, bench.rate_hz); });
  if (!performers) return std::unexpected(performers.error());
  auto avatars = ChildProcess::fork(hear_avatars);
  if (!avatars) return std::unexpected(avatars.error());
  const WorkFolder folder;
  const auto ports = free_ports(bench.performers);
  if (!ports) return std::unexpected(ports.error());
  const std::string avatar_port = avatars->pipes().read_line();
  const auto config = stage_config(bench, *ports, "127.0.0.1:" + avatar_port, folder);
  if (!config) return std::unexpected(config.error());
  auto daemon = assembly::Daemon::open(*config);
  if (!daemon) return std::unexpected(daemon.error());
  if (auto started = (*daemon)->start(); !started) return std::unexpected(started.error());
  (*subscriber)->begin({(*daemon)->publish_endpoint()});
  for (const int port : *ports) performers->pipes().write_line(address_of(port));
  performers->pipes().write_line("");
  StageFigures figures;
  watch(bench.seconds, figures);
  performers->pipes().close_to();
  std::this_thread::sleep_for(kSettle);  // for the last statistics
  count((*daemon)->stats(), figures);
  (*daemon)->stop();
  auto received = (*subscriber)->finish();
  if (!received) return std::unexpected(received.error());
  figures.gaps = received->gaps;
  figures.send = figures_of(send_ages_us(received->messages));
  avatars->pipes().close_to();
  if (!avatars->pipes().read(&figures.avatars_heard, sizeof figures.avatars_heard)) {
    return fail("the avatars' process ended early");
  }
  return figures;
}

nlohmann::ordered_json to_json(const StageBench& bench, const StageFigures& figures) {
  return {{"performers", bench.performers},
          {"points", bench.points},
          {"rate_hz", bench.rate_hz},
          {"seconds", bench.seconds},
          {"vmc", !bench.no_vmc},
          {"send", to_json(figures.send)},
          {"frames", figures.frames},
          {"dropped", figures.dropped},
          {"shed", figures.shed},
          {"kernel_dropped", figures.kernel_dropped},
          {"sequence_gaps", figures.gaps},
          {"vmc_sent", figures.sent_to_avatars},
          {"vmc_heard", figures.avatars_heard},
          {"vmc_dropped", figures.output_dropped},
          {"cpu_percent", figures.cpu_percent},
          {"rss_bytes", figures.rss_bytes},
          {"psi_cpu_some_percent", figures.pressure_percent}};
}

void print(const StageBench& bench, const StageFigures& figures) {
  const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  std::printf("%d performers x %.0f Hz over UDP x GP of %d poses, %d s\n", bench.performers,
              bench.rate_hz, bench.points, bench.seconds);
  print_figures({{"send", figures.send}});
  std::printf("published %llu frames; dropped %llu, shed %llu, by the kernel %llu, gaps %llu\n",
              number(figures.frames), number(figures.dropped), number(figures.shed),
              number(figures.kernel_dropped), number(figures.gaps));
  if (!bench.no_vmc) {
    std::printf("avatars: %llu datagrams sent, %llu heard, %llu frames dropped\n",
                number(figures.sent_to_avatars), number(figures.avatars_heard),
                number(figures.output_dropped));
  }
  std::printf("CPU %.1f %% of a core, RSS %.1f MB; CPU pressure (PSI some) %.1f %%\n",
              figures.cpu_percent, static_cast<double>(figures.rss_bytes) * 1e-6,
              figures.pressure_percent);
}

Result<> bench_stage(const StageBench& bench) {
  const auto measured = measure(bench);
  if (!measured) return std::unexpected(measured.error());
  tools::show(findings_of(bench, *measured), bench.json);
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
      ->check(in_range(10.0, 1000.0))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "How long it is measured")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  command->add_flag("--no-vmc", options->no_vmc, "Without avatars");
  command->add_flag("--realtime", options->realtime, "Ask for real-time rights, as `run` does");
  command->add_flag("--json", options->json, "JSON on stdout");
  command->footer(kBenchStageFooter);
  command->callback([options, &exit_code] {
    if (auto done = bench_stage(*options); !done) exit_code = tools::report(done.error());
  });
}

}  // namespace posed::bench
