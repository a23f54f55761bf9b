#include "daemon/tools/bench/hop_parts.hpp"

#include <algorithm>
#include <cstdio>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "daemon/tools/bench/bench_parts.hpp"
#include "daemon/tools/bench/bench_report.hpp"

namespace posed::tools {
namespace {

constexpr double kLeast_us = 0.1;  // a frame: threads that do less are left out

std::vector<ThreadShare> shares_of(const TimesByThread& times, std::size_t frames) {
  std::vector<ThreadShare> shares;
  const auto each = static_cast<double>(std::max<std::size_t>(frames, 1));
  for (const auto& [name, time] : times) {
    const ThreadShare share{.name = name,
                            .ran_us = static_cast<double>(time.ran_ns) * 1e-3 / each,
                            .waited_us = static_cast<double>(time.waited_ns) * 1e-3 / each,
                            .turns = static_cast<double>(time.turns) / each};
    if (share.ran_us + share.waited_us >= kLeast_us) shares.push_back(share);
  }
  std::ranges::sort(shares, std::ranges::greater{}, &ThreadShare::ran_us);
  return shares;
}

}  // namespace

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

nlohmann::ordered_json to_json(const HopParts& parts) {
  nlohmann::ordered_json threads = nlohmann::ordered_json::array();
  for (const ThreadShare& thread : parts.threads) {
    threads.push_back({{"thread", thread.name},
                       {"ran_us", thread.ran_us},
                       {"waited_us", thread.waited_us},
                       {"turns", thread.turns}});
  }
  return {{"decode", to_json(parts.decode)},
          {"stages", to_json(parts.stages)},
          {"hand_over", to_json(parts.hand_over)},
          {"socket", to_json(parts.socket)},
          {"one_thread_fewer_us", parts.one_thread_fewer_us()},
          {"threads_per_frame", threads}};
}

void print(const HopParts& parts) {
  std::printf("the pipeline's way in parts:\n");
  print_figures({{"decode", parts.decode},
                 {"stages", parts.stages},
                 {"hand-over", parts.hand_over},
                 {"socket", parts.socket}});
  std::printf("one thread fewer would save at most %.1f us of the median\n",
              parts.one_thread_fewer_us());
  std::printf("%-16s %9s %9s %9s   a frame\n", "thread", "ran us", "waits us", "turns");
  for (const ThreadShare& thread : parts.threads) {
    std::printf("%-16s %9.1f %9.1f %9.2f\n", thread.name.c_str(), thread.ran_us, thread.waited_us,
                thread.turns);
  }
}

std::vector<report::Figure> figures_of(const HopParts& parts, double bare_us) {
  report::PairedBars threads{
      .title = "What the daemon's threads did for each frame",
      .sentence =
          "A thread that waits was ready, but other threads or programs had the cores: "
          "that part is the scheduler's.",
      .quantity = "time for each frame",
      .unit = "us",
      .series = {"on a core", "ready, waiting for a core"},
      .rows = {}};
  for (const ThreadShare& thread : parts.threads) {
    threads.rows.push_back({thread.name, {thread.ran_us, thread.waited_us}});
  }
  return {report::percentile_bars(
              {.title = "The pipeline's way in parts",
               .sentence = fmt::format(
                   "A frame is decoded in the reader, handed to the pipeline, changed by its "
                   "stages, handed to the publisher, and sent through ZeroMQ. A bare hop takes "
                   "{:.0f} us at the median. One thread fewer would save at most {:.0f} us of it.",
                   bare_us, parts.one_thread_fewer_us()),
               .quantity = "time of a frame in each part",
               .peers = {{"decoding", percentiles_of(parts.decode)},
                         {"stages", percentiles_of(parts.stages)},
                         {"two hand-overs, encoding", percentiles_of(parts.hand_over)},
                         {"ZeroMQ to the subscriber", percentiles_of(parts.socket)}}}),
          report::paired_bars(threads)};
}

}  // namespace posed::tools
