// posed_bench json: what a frame of Rokoko Studio costs its decoder, beside nlohmann::json parsing
// the same text. The two take turns, frame by frame.
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/emulator.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"
#include "tests/support/processor_time.hpp"

namespace posed::bench {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kFrames = 600;  // ten seconds of the emulator, again and again

class IgnoringSink final : public Sink {
 public:
  void frame(std::size_t /*body*/, Frame& /*frame*/) noexcept override { ++frames; }
  void sample(std::size_t /*body*/, Sample& /*sample*/) noexcept override {}
  void outcome(Outcome /*outcome*/) noexcept override {}
  void description(std::span<const std::byte> bytes) noexcept override {
    described.assign(bytes.begin(), bytes.end());
  }
  Bytes described;
  std::uint64_t frames = 0;
};

std::vector<Bytes> studio_frames(bool lz4) {
  drivers::rokoko::StudioEmulator emulator(
      {.rate_hz = 60.0, .version = drivers::rokoko::StudioVersion::k3, .lz4 = lz4});
  std::vector<Bytes> frames(kFrames);
  for (Bytes& frame : frames) emulator.emit(emulator.next_due_ns(), frame);
  return frames;
}

// One way to read a frame, and what each of them took.
struct Way {
  const char* name;
  std::unique_ptr<drivers::rokoko::StudioDecoder> decoder{};
  std::unique_ptr<const drivers::SourceLayout> layout{};
  std::vector<double> us{};

  void learn(const Bytes& first) {
    IgnoringSink sink;
    decoder = std::make_unique<drivers::rokoko::StudioDecoder>();
    decoder->feed(first, 0, sink);
    layout = drivers::rokoko::make_layout(sink.described).value();
    decoder->use(*layout);
  }
};

json measure(int rounds) {
  const auto plain = studio_frames(false), packed = studio_frames(true);
  std::vector<Way> ways(4);
  ways[0].name = "decoded";
  ways[1].name = "decoded_lz4";
  ways[2].name = "only_read";
  ways[3].name = "nlohmann_parse";
  ways[0].learn(plain[0]);
  ways[1].learn(packed[0]);
  const auto read = std::make_unique<drivers::rokoko::StudioFrame>();
  IgnoringSink sink;
  std::size_t parsed = 0;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < kFrames; ++i) {
      const std::string_view text(reinterpret_cast<const char*>(plain[i].data()), plain[i].size());
      ways[0].us.push_back(test::timed_us([&] { ways[0].decoder->feed(plain[i], 0, sink); }));
      ways[1].us.push_back(test::timed_us([&] { ways[1].decoder->feed(packed[i], 0, sink); }));
      ways[2].us.push_back(
          test::timed_us([&] { (void)drivers::rokoko::read_studio_frame(text, *read); }));
      ways[3].us.push_back(test::timed_us([&] { parsed += json::parse(text).size(); }));
    }
  }
  json report{{"json_bytes", plain[kFrames / 2].size()},
              {"lz4_bytes", packed[kFrames / 2].size()},
              {"bodies_per_frame",
               static_cast<double>(sink.frames) / (2.0 * static_cast<double>(ways[0].us.size()))},
              {"parsed", parsed > 0}};
  for (const Way& way : ways) report[way.name] = percentiles(way.us);
  for (const char* figure : {"p50_us", "p99_us"}) {
    report[std::string("nlohmann_over_read_") + figure] =
        report["nlohmann_parse"][figure].get<double>() / report["only_read"][figure].get<double>();
  }
  return report;
}

}  // namespace

void add_bench_json(CLI::App& bench) {
  const auto rounds = std::make_shared<int>(10);
  CLI::App* command = bench.add_subcommand("json", "Rokoko Studio's frames beside nlohmann::json");
  command->add_option("--rounds", *rounds, "Times 600 frames")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  command->callback([rounds] { std::printf("%s\n", measure(*rounds).dump(2).c_str()); });
}

}  // namespace posed::bench
