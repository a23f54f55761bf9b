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

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/pipeline/ring.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/bench/bench_gloves.hpp"
#include "daemon/tools/bench/bench_report.hpp"
#include "daemon/tools/bench/percentiles.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/emulate/emulated_port.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
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

struct DecoderBench {
  std::string glove;
  int samples = 2000;
  ReportFile report;
  bool json = false;
};

BenchPage page_of_gloves(const json& gloves) {
  report::PairedBars late{.title = "What decoding adds to a read",
                          .sentence =
                              "99 of 100 packets are there within this time: where both "
                              "bars are equally long, decoding costs nothing beside the "
                              "read itself.",
                          .quantity = "from the write of a packet, p99",
                          .unit = "us",
                          .series = {"bare read", "decoded"},
                          .rows = {}};
  report::PairedBars fast{.title = "How much one core decodes",
                          .sentence =
                              "Packets decoded, calibrated and posed by one thread; a "
                              "glove sends a hundred or so a second.",
                          .quantity = "packets",
                          .unit = "millions a second",
                          .series = {"packets"},
                          .rows = {},
                          .digits = 2};
  double worst = 0.0;
  for (const json& glove : gloves) {
    const auto name = glove["glove"].get<std::string>();
    const json& latency = glove["latency"];
    late.rows.push_back({name,
                         {latency["bare_read"]["p99_us"].get<double>(),
                          latency["decoded"]["p99_us"].get<double>()}});
    fast.rows.push_back({name, {glove["throughput"]["packets_per_s"].get<double>() * 1e-6}});
    worst = std::max(worst, latency["p99_ratio"].get<double>());
  }
  BenchPage page{
      .command = "posed bench decoders",
      .verdict = fmt::format("at most {:.2f} times the time of a bare read (p99) over {} "
                             "gloves",
                             worst, gloves.size()),
      .good = true,
      .figures = {report::paired_bars(late), report::paired_bars(fast)}};
  for (const json& glove : gloves) {
    report::Figure figure = report::percentile_bars(
        {.title = glove["glove"].get<std::string>(),
         .sentence = "The same for this glove, with all percentiles; equal distances are "
                     "equal factors.",
         .quantity = "from the write of a packet",
         .peers = {{"bare read", percentiles_of(glove["latency"]["bare_read"])},
                   {"decoded", percentiles_of(glove["latency"]["decoded"])}}});
    figure.folded = true;
    page.figures.push_back(std::move(figure));
  }
  return page;
}

Result<> bench_decoders(const DecoderBench& bench) {
  if (auto checked = bench.report.check(); !checked) return checked;
  json report = json::array();
  if (!bench.json) std::printf("latency in us: p50, p99, p99.9, max\n");
  auto gloves = bench_gloves();
  if (!gloves) return std::unexpected(gloves.error());
  for (BenchGlove& glove : *gloves) {
    if (!glove.name.starts_with(bench.glove)) continue;
    json entry{{"glove", glove.name}, {"throughput", decoder_rate(glove)}};
    auto ways = decoder_latency(glove, bench.samples);
    if (!ways) return std::unexpected(ways.error());
    entry["latency"] = std::move(*ways);
    if (!bench.json) print_glove(entry);
    report.push_back(std::move(entry));
  }
  if (report.empty())
    return misuse("there is no glove '" + bench.glove + "'; leave --glove out to see them");
  if (bench.json) std::printf("%s\n", json_text(report, 2).c_str());
  return write_bench_page(page_of_gloves(report), report, bench.report);
}

}  // namespace

void add_bench_decoders(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<DecoderBench>();
  CLI::App* command = bench.add_subcommand("decoders", "The decoders of all gloves");
  command->footer(kDecodersFooter);
  command->add_option("--glove", options->glove, "Only gloves whose name begins with this");
  command->add_option("--samples", options->samples, "Timed packets for each glove and way")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  add_report_file(*command, options->report);
  command->add_flag("--json", options->json, "One JSON array on stdout");
  command->callback([options, &exit_code] {
    if (auto done = bench_decoders(*options); !done) {
      exit_code = report(done.error());
    }
  });
}

}  // namespace posed::tools
