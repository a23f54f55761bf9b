#include "daemon/cli/serve.hpp"

#include <csignal>
#include <cstdio>

#include <spdlog/spdlog.h>
#include <chrono>
#include <nlohmann/json.hpp>

namespace posed::cli {
namespace {

sigset_t end_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

void block_end_signals() {
  const sigset_t set = end_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

void print_ready(const pipeline::Daemon& daemon) {
  nlohmann::ordered_json line{{"ready", true},
                              {"publish", daemon.publish_endpoint()},
                              {"control", daemon.control_endpoint()},
                              {"streams", nlohmann::json::array()}};
  for (const auto& stream : daemon.streams()) line["streams"].push_back(stream->config.name);
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

void serve(pipeline::Daemon& daemon, const ServeOptions& options) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const sigset_t set = end_signals();
  const timespec look_every{.tv_sec = 0, .tv_nsec = 50'000'000};
  while (true) {
    if (const int signal = sigtimedwait(&set, nullptr, &look_every); signal > 0) {
      spdlog::info("{}: ending", signal == SIGINT ? "interrupted" : "terminated");
      break;
    }
    if (daemon.asked_to_stop()) {
      spdlog::info("asked to stop: ending");
      break;
    }
    if (options.until_end && daemon.all_ended()) break;
    const std::chrono::duration<double> served = Clock::now() - start;
    if (options.seconds && served.count() >= *options.seconds) break;
  }
  daemon.stop();
}

}  // namespace posed::cli
