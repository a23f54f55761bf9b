// `posed bench decoders`: how many packets a second each glove's decoder handles on one core, and
// what it adds to a bare read() of the same pseudo-terminal.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/cli/bench/bench_gloves.hpp"
#include "daemon/cli/bench/percentiles.hpp"
#include "daemon/cli/cli.hpp"
#include "daemon/emulate/emulated_port.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/clock.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/text/json_text.hpp"

namespace posed::cli {
namespace {

using nlohmann::json;
using system::monotonic_ns;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kLoopRecords = 512;  // of the data that is decoded repeatedly
constexpr std::size_t kReadBytes = 4096;   // most bytes of a read
constexpr auto kPacketPause = std::chrono::milliseconds(1);
constexpr const char* kDecodersFooter =
    R"(Every glove that posed can emulate, its bytes as the emulator sends them.
packets/s: decoded, calibrated, posed and put into a ring, by CPU time of one thread.
latency: from before the write of a whole packet into a pseudo-terminal to its read() (bare) or to
its frame in a ring (decoded); packets take turns between the two, one a millisecond.

  posed bench decoders
  posed bench decoders --glove cyberglove --samples 500 --json)";

// Does what a reader's sink does: puts items into a ring.
class RingSink final : public Sink {
 public:
  void frame(std::size_t /*body*/, Frame& frame) noexcept override {
    static_cast<void>(ring_.push(frame));
    ++frames;
  }
  void sample(std::size_t /*body*/, Sample& /*sample*/) noexcept override { ++samples; }
  void outcome(Outcome outcome) noexcept override { bad += outcome == Outcome::kOk ? 0 : 1; }
  void empty_ring() noexcept {
    while (ring_.consume([](Frame&) {})) {
    }
  }
  std::uint64_t frames = 0, samples = 0, bad = 0;

 private:
  pipeline::Ring<Frame> ring_{256};
};

// CPU time of this thread, so that other programs on the machine do not count.
std::int64_t cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * kNanosPerSecond + now.tv_nsec;
}

json decoder_rate(BenchGlove& glove) {
  Bytes bytes;
  for (std::size_t i = 0; i < kLoopRecords; ++i) next_record(glove, i, bytes);
  RingSink sink;
  const std::span<const std::byte> all(bytes);
  const std::int64_t start_ns = cpu_ns();
  std::int64_t end_ns = start_ns;
  while (end_ns - start_ns < kNanosPerSecond / 2) {
    for (std::size_t at = 0; at < all.size(); at += kReadBytes) {
      glove.decoder->feed(all.subspan(at, std::min(kReadBytes, all.size() - at)), start_ns, sink);
      sink.empty_ring();
    }
    end_ns = cpu_ns();
  }
  return {{"record_bytes", bytes.size() / kLoopRecords},
          {"packets_per_s", static_cast<double>(sink.samples) / seconds(end_ns - start_ns)},
          {"frames_per_s", static_cast<double>(sink.frames) / seconds(end_ns - start_ns)},
          {"damaged", sink.bad}};
}

// Both ends of a pseudo-terminal, and when the current packet was written.
struct BenchLine {
  emulate::EmulatedPort port;
  std::unique_ptr<drivers::Transport> host;
  std::atomic<std::int64_t> written_ns{0};
};

// Waits for the packet and reads it, with or without the decoder; 0 if none came.
std::int64_t take_record(BenchLine& line, std::size_t bytes, drivers::Decoder* decoder,
                         RingSink& sink) {
  std::array<std::byte, kReadBytes> buffer{};
  while (bytes > 0) {
    pollfd wait{line.host->poll_fd(), POLLIN, 0};
    if (::poll(&wait, 1, 1000) <= 0) return 0;
    std::size_t got = 0;
    if (decoder == nullptr) {
      const ssize_t size = ::read(wait.fd, buffer.data(), buffer.size());
      got = size > 0 ? static_cast<std::size_t>(size) : 0;
    } else {
      const drivers::Chunk chunk = line.host->read(monotonic_ns());
      decoder->feed(chunk.bytes, 0, sink);
      got = chunk.bytes.size();
    }
    if (got == 0) return 0;
    bytes -= std::min(bytes, got);
  }
  return monotonic_ns();
}

Result<json> decoder_latency(BenchGlove& glove, int samples) {
  auto port = emulate::EmulatedPort::open_pty();
  if (!port) return std::unexpected(port.error());
  drivers::TransportFactory ports;
  auto link = ports.serial({.port = port->name()});
  if (!link) return std::unexpected(link.error());
  BenchLine line{std::move(*port), drivers::make_link_transport(std::move(*link))};
  std::vector<double> bare_us, decoded_us;
  RingSink sink;
  std::atomic<int> wanted{0};
  std::atomic<std::size_t> size{0};
  std::jthread glove_side([&](const std::stop_token& stop) {
    Bytes record;
    for (int sent = 0; !stop.stop_requested(); std::this_thread::sleep_for(kPacketPause)) {
      if (wanted.load() == sent) continue;
      record.clear();
      next_record(glove, static_cast<std::size_t>(++sent), record);
      size.store(record.size());
      line.written_ns.store(monotonic_ns());
      line.port.send(0, record);
    }
  });
  for (int i = 0; i < 2 * samples; ++i) {
    const bool decode = i % 2 == 1;
    const std::uint64_t before = sink.samples;
    wanted.fetch_add(1);
    pollfd wait{line.host->poll_fd(), POLLIN, 0};
    if (::poll(&wait, 1, 1000) <= 0) return fail("the pseudo-terminal gives nothing");
    const std::int64_t done_ns =
        take_record(line, size.load(), decode ? glove.decoder.get() : nullptr, sink);
    sink.empty_ring();
    if (done_ns == 0) return fail("a packet did not come through the pseudo-terminal");
    // the stream began in the middle of a packet that was skipped
    if (decode && sink.samples == before) continue;
    (decode ? decoded_us : bare_us)
        .push_back(static_cast<double>(done_ns - line.written_ns.load()) * 1e-3);
  }
  json report{{"bare_read", percentiles(bare_us)}, {"decoded", percentiles(decoded_us)}};
  report["p99_ratio"] =
      report["decoded"]["p99_us"].get<double>() / report["bare_read"]["p99_us"].get<double>();
  return report;
}

void print_glove(const json& glove) {
  const json& rate = glove["throughput"];
  std::printf("%-28s %4llu bytes %6.2f M packets/s", glove["glove"].get<std::string>().c_str(),
              static_cast<unsigned long long>(rate["record_bytes"].get<std::uint64_t>()),
              rate["packets_per_s"].get<double>() * 1e-6);
  for (const char* const way : {"bare_read", "decoded"}) {
    const json& us = glove["latency"][way];
    std::printf("  %s %5.1f %5.1f %6.1f %6.1f", way, us["p50_us"].get<double>(),
                us["p99_us"].get<double>(), us["p99_9_us"].get<double>(),
                us["max_us"].get<double>());
  }
  std::printf("  p99 x%.2f\n", glove["latency"]["p99_ratio"].get<double>());
}

Result<> bench_decoders(const std::string& only, int samples, bool as_json) {
  json report = json::array();
  if (!as_json) std::printf("latency in us: p50, p99, p99.9, max\n");
  auto gloves = bench_gloves();
  if (!gloves) return std::unexpected(gloves.error());
  for (BenchGlove& glove : *gloves) {
    if (!glove.name.starts_with(only)) continue;
    json entry{{"glove", glove.name}, {"throughput", decoder_rate(glove)}};
    auto ways = decoder_latency(glove, samples);
    if (!ways) return std::unexpected(ways.error());
    entry["latency"] = std::move(*ways);
    if (!as_json) print_glove(entry);
    report.push_back(std::move(entry));
  }
  if (report.empty())
    return misuse("there is no glove '" + only + "'; leave --glove out to see them");
  if (as_json) std::printf("%s\n", json_text(report, 2).c_str());
  return {};
}

}  // namespace

void add_bench_decoders(CLI::App& bench, int& exit_code) {
  struct Options {
    std::string glove;
    int samples = 2000;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = bench.add_subcommand("decoders", "The decoders of all gloves");
  command->footer(kDecodersFooter);
  command->add_option("--glove", options->glove, "Only gloves whose name begins with this");
  command->add_option("--samples", options->samples, "Timed packets for each glove and way")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "One JSON array on stdout");
  command->callback([options, &exit_code] {
    if (auto done = bench_decoders(options->glove, options->samples, options->json); !done) {
      exit_code = report(done.error());
    }
  });
}

}  // namespace posed::cli
