// `posed emulate`: emulates a device for any program that expects one.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/net/security.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/devices/driver_options.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "daemon/tools/emulate/log_emulator.hpp"
#include "daemon/tools/emulate/motions.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/load_file.hpp"

namespace posed::tools {
namespace {

struct EmulateOptions {
  std::string what;  // a log's path or a driver's name
  std::string stream;
  std::string tcp, listen, publish;
  std::vector<std::string> udp;
  std::filesystem::path link;
  std::vector<std::filesystem::path> clips;
  std::vector<std::string> set;     // KEY=VALUE
  std::vector<std::string> faults;  // KIND:RATE
  std::uint64_t seed = 1;
  bool pty = false;
  bool insecure = false;
  double speed = 1.0;
  std::optional<double> seconds;
};

// What is emulated, and the driver that hears it.
struct Emulated {
  std::unique_ptr<drivers::Emulator> emulator;
  const drivers::Driver* driver = nullptr;
};

// The motion of an emulated hand: a clip, or gestures of a synthetic person. Bodies perform a clip
// or move by themselves.
Result<emulate::Motion> motion(const EmulateOptions& options, const Emulated& emulated) {
  if (emulated.driver == nullptr || emulated.driver->glove == nullptr) {
    if (options.clips.empty()) return emulate::Motion();
    return emulate::clip_motion(options.clips, *emulated.emulator);
  }
  if (options.clips.size() > 1) return misuse("a glove performs one clip: name one");
  auto clip = std::make_shared<clip::HandClip>();
  if (!options.clips.empty()) {
    auto read = TRY(clip::read_hand_clip(options.clips.front()));
    *clip = std::move(read);
  } else {
    auto made = TRY(gesture::make_performance({.script = {"p", "g", "c", "p", "1", "3", "4", "p"},
                                               .noise_deg = 0.0,
                                               .dead_band_deg = 0}));
    *clip = std::move(made.clip);
  }
  return emulate::hand_motion([clip](double time_s) { return emulate::pose_at(*clip, time_s); });
}

Result<std::unique_ptr<drivers::Emulator>> make_emulator(const std::string& name,
                                                         const std::vector<std::string>& set) {
  const drivers::Driver* driver = drivers::find_driver(name);
  if (driver == nullptr || driver->emulate == nullptr) {
    std::string known;
    for (const drivers::Driver& other : drivers::registry()) {
      if (other.emulate != nullptr) add_word(known, other.name);
    }
    if (name.ends_with(".plog") || name.find('/') != std::string::npos) TRY(expect_there(name));
    return misuse("'" + name +
                  "' is neither a log nor a device that can be emulated; there is: " + known);
  }
  auto options = TRY(parse_driver_options(*driver, set));
  return driver->emulate(options);
}

Result<Emulated> open_emulator(const EmulateOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(options.what, ignored)) {
    if (!options.stream.empty()) {
      return misuse("--stream chooses from a log's streams; '" + options.what + "' is not a log");
    }
    auto made = TRY(make_emulator(options.what, options.set));
    return Emulated{.emulator = std::move(made), .driver = drivers::find_driver(options.what)};
  }
  if (!options.clips.empty()) return misuse("a log has its own motion: leave out --clip");
  const std::size_t addresses = std::max<std::size_t>(options.udp.size(), 1);
  auto device = TRY(emulate::read_logged_device(options.what, options.stream, addresses));
  std::unique_ptr<drivers::Emulator> speaker;
  const drivers::Driver* driver = drivers::find_driver(device.driver);
  if (driver != nullptr && driver->emulate != nullptr) {
    speaker = TRY(make_emulator(device.driver, options.set));
  } else if (!options.set.empty()) {
    return misuse("the log's device (driver '" + device.driver +
                  "') takes no options: leave out --set");
  }
  return Emulated{.emulator = std::make_unique<emulate::LogEmulator>(std::move(device.recording),
                                                                     std::move(speaker)),
                  .driver = driver};
}

// The address that a device over UDP sends to when --udp does not say: where posed listens.
std::optional<std::string> default_udp(const EmulateOptions& options,
                                       const drivers::Driver* driver) {
  if (driver == nullptr || driver->make_layout == nullptr) return std::nullopt;
  const auto set = parse_driver_options(*driver, options.set);
  if (!set) return std::nullopt;
  const auto listen = set->find("listen");
  if (listen == set->end()) return std::nullopt;
  return std::get<std::string>(listen->second);
}

// Refuses a way on which the driver would never hear the device. A device with one body is on a
// port, or connects where its driver has a socket to listen on; one with several sends datagrams,
// or a stream of bytes where its driver has the option `link`; another posed publishes.
Result<> check_way(const EmulateOptions& options, const drivers::Driver* driver) {
  if (driver == nullptr || driver->emulate == nullptr) return {};  // a log of another version
  const auto has = [&](std::string_view option) {
    return std::ranges::find(driver->options, option, &drivers::OptionSpec::name) !=
           driver->options.end();
  };
  const bool bodies = driver->make_layout != nullptr;
  struct Way {
    std::string_view words;
    bool chosen, used;
  };
  const std::array ways{
      Way{"--link PATH", options.pty || !options.link.empty(), !bodies},
      Way{"--tcp HOST:PORT", !options.tcp.empty(), has("listen") && (!bodies || has("link"))},
      Way{"--listen IP:PORT", !options.listen.empty(), has("link") && has("connect")},
      Way{"--udp IP:PORT", !options.udp.empty(), bodies && has("listen")},
      Way{"--publish ENDPOINT", !options.publish.empty(), bodies && !has("listen")}};
  std::string used;
  for (const Way& way : ways) {
    if (way.used) add_word(used, way.words, " or ");
  }
  for (const Way& way : ways) {
    if (!way.chosen || way.used) continue;
    return misuse(fmt::format("posed does not listen for {} over {}; give {}", driver->name,
                              way.words.substr(0, way.words.find(' ')), used));
  }
  const bool publishes = ways.back().used && options.publish.empty();
  if (publishes) return misuse(fmt::format("{} is heard over ZeroMQ; give {}", driver->name, used));
  return {};
}

// What other machines can reach needs --insecure, and only that may have it.
Result<> check_reach(const EmulateOptions& options) {
  const bool publishes = !options.publish.empty();
  const std::string& address = publishes ? options.publish : options.listen;
  if (address.empty() || net::is_loopback(publishes ? address : "tcp://" + address)) {
    if (!options.insecure) return {};
    return misuse(address.empty()
                      ? "--insecure has no effect without --listen and --publish: leave it out"
                      : "--insecure has no effect at " + clean_name(address) +
                            ", which only this machine reaches: leave it out");
  }
  if (options.insecure) return {};
  return misuse(net::open_to_anyone(address) +
                (publishes ? "; publish at tcp://127.0.0.1:PORT" : "; listen at 127.0.0.1:PORT") +
                ", or say --insecure");
}

Result<emulate::EmulatedPort> open_port(const EmulateOptions& options, const Emulated& emulated) {
  const auto ports = emulated.emulator->ports();
  if (ports.size() > std::max<std::size_t>(options.udp.size(), 1)) {
    return misuse("this device sends to " + std::to_string(ports.size()) +
                  " sockets of the host; name one address for each with --udp, in their order");
  }
  if (!options.udp.empty()) return emulate::EmulatedPort::open_udp(options.udp, ports);
  if (!options.tcp.empty()) return emulate::EmulatedPort::connect_tcp(options.tcp);
  if (!options.listen.empty()) return emulate::EmulatedPort::listen_tcp(options.listen);
  if (!options.publish.empty()) return emulate::EmulatedPort::publish(options.publish);
  if (const auto to = default_udp(options, emulated.driver); to) {
    return emulate::EmulatedPort::open_udp({*to});
  }
  return emulate::EmulatedPort::open_pty(options.link);
}

Result<> emulate(const EmulateOptions& options) {
  const Interrupt interrupt;
  TRY(check_reach(options));
  auto emulated = TRY(open_emulator(options));
  TRY(check_way(options, emulated.driver));
  emulate::EmulatedDevice::Settings settings{.speed = options.speed};
  for (const std::string& word : options.faults) {
    const auto fault = TRY(drivers::emulate::parse_fault(word));
    settings.faults.emplace_back(fault, options.seed + settings.faults.size());
  }
  auto moves = TRY(motion(options, emulated));
  auto port = TRY(open_port(options, emulated));
  Findings ready;
  ready.add("port", options.link.empty() ? port.name() : options.link.string());
  emulate::EmulatedDevice device(std::move(emulated.emulator), std::move(port), std::move(moves),
                                 std::move(settings));
  ready.show(true, -1);
  std::atomic<bool> ended{false};
  std::jthread thread([&](const std::stop_token& stop) {
    device.run(stop);
    ended = true;
  });
  const auto start = std::chrono::steady_clock::now();
  const auto over = [&] {
    return options.seconds && std::chrono::steady_clock::now() - start >=
                                  std::chrono::duration<double>(*options.seconds);
  };
  while (!Interrupt::came() && !ended && !over()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  thread.request_stop();
  thread.join();
  std::fprintf(stderr, "%llu packets sent\n", static_cast<unsigned long long>(device.packets()));
  return {};
}

}  // namespace

void add_emulate(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "emulate", "Emulate a device on a pseudo-terminal, a TCP connection, over UDP or ZeroMQ");
  auto options = std::make_shared<EmulateOptions>();
  command->add_option("WHAT", options->what, "A device log (.plog) or a driver's name")->required();
  auto* pty = command->add_flag("--pty", options->pty, "Behind a pseudo-terminal (the default)");
  auto* tcp = command->add_option("--tcp", options->tcp, "Connect to a host that waits for gloves");
  tcp->type_name("HOST:PORT")->excludes(pty);
  auto* listen = command->add_option("--listen", options->listen,
                                     "Wait for a host that connects, as systems with a server do");
  listen->type_name("IP:PORT")->excludes(pty)->excludes(tcp);
  auto* udp = command->add_option("--udp", options->udp,
                                  "Send datagrams to a host; several: one for each of its sockets");
  udp->type_name("IP:PORT")->excludes(pty)->excludes(tcp)->excludes(listen);
  auto* publish = command->add_option("--publish", options->publish,
                                      "Publish over ZeroMQ, as another posed does");
  publish->type_name("ENDPOINT")->excludes(pty)->excludes(tcp)->excludes(listen)->excludes(udp);
  command->add_flag("--insecure", options->insecure,
                    "Let other machines reach --listen or --publish");
  command->add_option("--link", options->link, "Also a link to the pseudo-terminal, by this name")
      ->type_name("PATH")
      ->excludes(tcp)
      ->excludes(listen)
      ->excludes(udp)
      ->excludes(publish);
  command->add_option("--speed", options->speed, "Times the device's own pace, 0.01 to 1000")
      ->capture_default_str()
      ->check(in_range(0.01, 1000.0));
  command
      ->add_option("--clip", options->clips,
                   "The motion: a hand CSV for a glove (default: synthetic gestures), a BVH or AMC "
                   "for bodies (default: their own); once for each person")
      ->type_name("FILE")
      ->allow_extra_args(false);  // the device's name may come behind it
  command->add_option("--set", options->set, "An option of the driver, like hand=left")
      ->type_name("KEY=VALUE");
  auto* fault = command
                    ->add_option("--fault", options->faults,
                                 "A fault of the line, with its rate per byte or packet")
                    ->type_name("KIND:RATE");
  command->add_option("--seed", options->seed, "Of the faults: the same seed gives the same faults")
      ->needs(fault)
      ->check(whole_number())
      ->capture_default_str();
  command->add_option("--stream", options->stream, "Which stream of the log")->type_name("NAME");
  command->add_option("--seconds", options->seconds, "End after so many seconds")
      ->type_name("SECONDS")
      ->check(above_zero());
  command->footer(R"(Prints one JSON line {"port": ...} when it can be opened. Examples:
  posed emulate cyberglove --link /tmp/glove   # and a stream with port = "/tmp/glove"
  posed emulate lucidgloves --tcp 127.0.0.1:65432
  posed emulate template_mocap --udp 127.0.0.1:7400
  posed emulate posed --set stream=ann --publish tcp://127.0.0.1:5575
  posed emulate take1.plog --stream right      # the bytes of a recorded glove
  posed emulate cyberglove --fault drop:0.01 --fault burst:0.001
Faults of so many bytes: drop, zero, flip, insert, noise (any of drop, flip, insert);
of so many packets: duplicate, silence, baud, burst.)");
  command->callback([options, &exit_code] { exit_code = report(emulate(*options)); });
}

}  // namespace posed::tools
