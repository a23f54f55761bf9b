#include "daemon/tools/logs/replay_outputs.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <ostream>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <pugixml.hpp>

#include "daemon/tools/run/recording.hpp"
#include "models/gp/isa.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::tools {

Result<FrameFile> FrameFile::create(const std::filesystem::path& path) {
  auto file = TRY(WholeFile::open(path));
  return FrameFile(std::move(file));
}

void FrameFile::add(const v1::Frame& frame) {
  frame.SerializeToString(&bytes_);
  const auto size = static_cast<std::uint32_t>(bytes_.size());
  std::array<char, 4> length{};
  for (std::size_t i = 0; i < length.size(); ++i) length[i] = static_cast<char>(size >> (8 * i));
  file_.out().write(length.data(), length.size());
  file_.out().write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
}

Findings findings_of(const std::string& log, const std::string& recorded_isa,
                     const ReplayOutcome& outcome) {
  Findings findings;
  findings.add("log", log)
      .add("same", outcome.problem.empty())
      .add("frames", outcome.frames)
      .add("raw_frames", outcome.raw_frames)
      .add("compared", outcome.counts.compared)
      .add("lost", outcome.counts.lost)
      .add("after_gap", outcome.counts.after_gap)
      .add("past_end", outcome.counts.past_end)
      .add("isa", outcome.isa)
      .add("recorded_isa", recorded_isa)
      .add("missing", outcome.missing)
      .add("took_s", outcome.took_s);
  return outcome.problem.empty() ? findings : findings.add("problem", outcome.problem);
}

ReplayOutputs::ReplayOutputs(const replay::Replay& replay) : replay_(replay) {
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const std::string& name = replay.stream(id).name;
    encoders_.push_back({message::FrameEncoder(name), message::FrameEncoder(raw_name(name))});
  }
}

void ReplayOutputs::add(const pipeline::Item& item) {
  if (broadcast) broadcast->add(item);
  const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
  if (!raw && item.kind != pipeline::Item::Kind::kFrame) return;
  ++frames;
  if (raw) ++raw_frames;
  const std::uint32_t stream = item.frame.header.stream;
  const v1::Frame& frame = encoders_[stream][raw].encode(item.frame);
  if (file) file->add(frame);
  if (!expectation || difference) return;
  auto same = expectation->compare(stream, raw, frame, replay_.broken_at(stream));
  if (!same) difference = same.error();
}

Result<> ReplayOutputs::finish() {
  if (file) {
    TRY(file->close());
  }
  for (std::uint32_t id = 0; expectation && !difference && id < encoders_.size(); ++id) {
    auto same = expectation->finish(id, replay_.broken_at(id));
    if (!same) difference = same.error();
  }
  if (difference) return std::unexpected(*difference);
  return expectation ? expectation->check_compared() : Result<>{};
}

std::string recorded_isa(const log::Reader& reader) {
  const auto meta = reader.meta().find("isa");
  return meta == reader.meta().end() ? "auto" : meta->second;
}

Result<> set_isa_or(const std::string& wanted, const std::string& recorded) {
  if (!wanted.empty()) return gp::set_isa(wanted);
  if (gp::set_isa(recorded)) return {};
  return gp::set_isa("auto");
}

namespace {

void add_gaps(const log::Reader& reader, std::vector<std::string>& missing) {
  constexpr std::array<const char*, 3> kNames{"chunks", "decisions", "published frames"};
  const auto gaps = reader.gaps();
  if (!gaps) return;  // cannot happen: open() has read the gaps already
  for (const log::GapRow& gap : *gaps) {
    const bool chunks = gap.kind == log::GapRow::Kind::kChunks;
    const auto owner =
        chunks ? std::ranges::find(reader.sources(), gap.owner, &log::SourceRow::id)->name
               : reader.streams()[*reader.place_of_stream(gap.owner)].name;
    const auto kind = std::min<std::size_t>(static_cast<std::size_t>(gap.kind), 2);
    missing.push_back(fmt::format("{} {}: the log lacks {} {} after chunk {}",
                                  chunks ? "source" : "stream", owner, gap.lost, kNames[kind],
                                  gap.after_chunk));
  }
}

void add_undescribed(const replay::Replay& replay, std::vector<std::string>& missing) {
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const replay::ReplayStream& stream = replay.stream(id);
    if (stream.described) continue;
    missing.push_back(
        fmt::format("stream {}: the log lacks the description of {}'s body {}, so nothing of it is"
                    " replayed",
                    clean_name(stream.name), clean_name(stream.source), clean_name(stream.body)));
  }
}

void add_without_body(const log::Reader& reader, std::vector<std::string>& missing) {
  for (const log::SourceRow& source : reader.sources()) {
    const auto& streams = reader.streams();
    if (std::ranges::find(streams, source.id, &log::StreamRow::source) == streams.end()) {
      missing.push_back(no_body_of(source.name));
    }
  }
}

}  // namespace

std::vector<std::string> missing_from(const log::Reader& reader, const replay::Replay& replay) {
  std::vector<std::string> missing;
  add_gaps(reader, missing);
  add_undescribed(replay, missing);
  add_without_body(reader, missing);
  return missing;
}

Result<> write_junit(const std::filesystem::path& path, std::span<const JUnitCase> cases) {
  double took_s = 0.0;
  for (const JUnitCase& one : cases) took_s += one.took_s;
  pugi::xml_document document;
  auto suite = document.append_child("testsuites").append_child("testsuite");
  const auto set = [](pugi::xml_node node, const char* name, std::string_view value) {
    node.append_attribute(name).set_value(clean(value).c_str());
  };
  set(suite, "name", "posed replay");
  set(suite, "tests", fmt::format("{}", cases.size()));
  set(suite, "failures", fmt::format("{}", std::ranges::count_if(cases, [](const JUnitCase& one) {
                                       return !one.problem.empty();
                                     })));
  set(suite, "time", fmt::format("{:.3f}", took_s));
  for (const JUnitCase& one : cases) {
    auto test = suite.append_child("testcase");
    set(test, "classname", "posed.replay");
    set(test, "name", one.name);
    set(test, "time", fmt::format("{:.3f}", one.took_s));
    if (!one.problem.empty()) set(test.append_child("failure"), "message", one.problem);
  }
  return write_whole_file(path, [&](std::ostream& out) { document.save(out, "  "); });
}

}  // namespace posed::tools
