#include "daemon/tools/run/serve.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <chrono>

#include "daemon/config/config.hpp"
#include "daemon/logging/log_output.hpp"
#include "daemon/service/service.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/command/findings.hpp"
#include "drivers/transport/address.hpp"

namespace posed::tools {
namespace {

constexpr std::chrono::milliseconds kReadyLineWithin{300};

// Returns whether the daemon uses keys, so that there is a list to read. If the config is wrong the
// old list stays in use.
bool read_clients_again(assembly::Daemon& daemon, const std::string& path) {
  if (path.empty() || !daemon.wants_keys()) return false;
  const auto config = config::load_config(path, drivers::registry());
  if (!config) {
    spdlog::error("the client list stays as it was: {}", config.error().text());
    return true;
  }
  if (config->security.server_key.empty()) {
    spdlog::error(
        "the client list stays as it was: {} has no [security] server_key any more; a daemon that"
        " began with keys keeps them until it is started again",
        path);
    return true;
  }
  daemon.allow(config->security.clients);
  spdlog::info("{} clients may connect now", config->security.clients.size());
  return true;
}

// Returns whether SIGHUP has been obeyed, so that the daemon goes on.
bool reload(assembly::Daemon& daemon, const std::string& path, service::Service& service) {
  service.reloading();
  const bool read = read_clients_again(daemon, path);
  if (!read && !service.present()) return false;
  if (!read) spdlog::info("nothing is read again: without keys the config has no list of clients");
  service.ready();
  return true;
}

bool has_several(const std::unique_ptr<devices::OpenSource>& source) {
  return source->has_several();
}

// For `systemctl status`. It asks no thread, because that one may be stuck.
std::string status_of(const assembly::Daemon& daemon) {
  const auto streams = daemon.stream_counts();
  return fmt::format(
      "{} of {} streams live, {} sources of several bodies; poses at {}", streams.live, streams.all,
      std::ranges::count_if(daemon.sources(), has_several), daemon.publish_endpoint());
}

}  // namespace

sigset_t end_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGHUP);
  return set;
}

void add_serve_options(CLI::App& command, ServeOptions& options) {
  command.add_option("--config", options.config, "The daemon's config, TOML")->required();
  command.add_option("--seconds", options.seconds, "End after so many seconds")
      ->type_name("SECONDS")
      ->check([](const std::string& text) {
        return std::strtod(text.c_str(), nullptr) > 0.0
                   ? std::string()
                   : "'" + text + "' is not a time to run: give seconds above 0";
      });
  command.add_flag("--until-end", options.until_end,
                   "End when every source that can end has ended: not gloves or looped clips");
}

void prepare_to_serve() {
  logging::sum_up_repeats();
  const sigset_t set = end_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

Result<> check_end(const assembly::Daemon& daemon, const ServeOptions& options) {
  const auto endless = [](const auto& source) { return source->endless; };
  if (!options.until_end || !std::ranges::all_of(daemon.sources(), endless)) return {};
  return misuse(
      "--until-end: no source of this config ever ends (gloves come and go, clips loop); leave it"
      " out, give --seconds, or set loop = false");
}

void print_ready(const assembly::Daemon& daemon) {
  for (const auto& [name, address] : drivers::resolved_names()) {
    spdlog::info("{} is {}, until this daemon is started again", name, address);
  }
  std::vector<std::string> sources;
  for (const auto& source : daemon.sources()) {
    if (source->has_several()) sources.push_back(source->config.name);
  }
  Findings ready;
  ready.add("ready", true)
      .add("publish", daemon.publish_endpoint())
      .add("control", daemon.control_endpoint())
      .add("streams", daemon.stream_names());
  if (!sources.empty()) ready.add("sources", sources);
  if (!daemon.metrics_url().empty()) ready.add("metrics", daemon.metrics_url());
  const std::string line = ready.json();
  // Not through stdio, because a pipe that is full or that nobody reads must not delay the signals
  // that stop the daemon.
  if (!logging::write_within(STDOUT_FILENO, line + '\n', kReadyLineWithin)) {
    spdlog::warn("the line with the daemon's endpoints cannot be written to stdout: {}", line);
  }
}

void serve(assembly::Daemon& daemon, const ServeOptions& options,
           std::vector<system::ThreadPulse> more) {
  using Steady = std::chrono::steady_clock;
  const auto start = Steady::now();
  const sigset_t set = end_signals();
  const timespec look_every{.tv_sec = 0, .tv_nsec = 50'000'000};
  std::ranges::move(daemon.pulses(), std::back_inserter(more));
  service::Service service(std::move(more));
  service.ready();
  while (true) {
    if (service.present()) service.status(status_of(daemon));
    service.turn(system::monotonic_ns());
    if (const int signal = sigtimedwait(&set, nullptr, &look_every); signal > 0) {
      if (signal == SIGHUP && reload(daemon, options.config, service)) continue;
      spdlog::info("{}: ending", signal == SIGINT ? "interrupted" : "terminated");
      break;
    }
    if (daemon.asked_to_stop()) {
      spdlog::info("asked to stop: ending");
      break;
    }
    if (options.until_end && daemon.all_ended()) break;
    const std::chrono::duration<double> served = Steady::now() - start;
    if (options.seconds && served.count() >= *options.seconds) break;
  }
  service.stopping();
  daemon.stop();
}

}  // namespace posed::tools
