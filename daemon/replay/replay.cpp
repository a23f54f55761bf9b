#include "daemon/replay/replay.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "daemon/record/decision_code.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

// More than any posed records; a limit, because each stream costs a decoder and an engine.
constexpr std::size_t kMaxStreams = 256;

}  // namespace

Replay::Replay(log::Reader& reader)
    : reader_(reader), models_(reader), schedule_(reader.streams().size(), reader.counts_items()) {}

Result<std::unique_ptr<Replay>> Replay::open(log::Reader& reader) {
  std::unique_ptr<Replay> replay(new Replay(reader));
  if (auto done = replay->open_contexts(); !done) return std::unexpected(done.error());
  if (auto done = replay->load_decisions(); !done) return std::unexpected(done.error());
  if (auto done = replay->load_gaps(); !done) return std::unexpected(done.error());
  for (const auto& context : replay->contexts_) context->ready();
  return replay;
}

Result<> Replay::open_contexts() {
  const auto& streams = reader_.streams();
  if (streams.size() > kMaxStreams) {
    return fail("holds " + std::to_string(streams.size()) + " streams, and this posed replays " +
                    std::to_string(kMaxStreams) + " at most",
                reader_.file());
  }
  for (const log::StreamRow& row : streams) {
    const log::SourceRow& source = reader_.source_of(row);
    if (std::ranges::count(streams, row.source, &log::StreamRow::source) > 1) {
      return fail("source " + in_quotes(source.name) +
                      " has several bodies, which this posed cannot replay; update posed",
                  reader_.file());
    }
    const auto id = static_cast<std::uint32_t>(contexts_.size());
    auto context = ReplayStreamContext::open(id, source, row, models_, *this, reader_.file());
    if (!context) return std::unexpected(context.error());
    contexts_.push_back(std::move(*context));
  }
  return {};
}

Result<> Replay::load_decisions() {
  auto rows = reader_.decisions();
  if (!rows) return std::unexpected(rows.error());
  for (log::DecisionRow& row : *rows) {
    const auto decision = record::decision_of(row, reader_.file());
    if (!decision) return std::unexpected(decision.error());
    const std::size_t stream = *reader_.place_of_stream(row.stream);
    if (auto done = contexts_[stream]->expect(*decision); !done) return done;
    schedule_.add({stream, std::move(row)});
  }
  return {};
}

Result<> Replay::load_gaps() {
  const auto gaps = reader_.gaps();
  if (!gaps) return std::unexpected(gaps.error());
  for (const log::GapRow& gap : *gaps) {
    for (std::size_t i = 0; i < contexts_.size(); ++i) {
      const log::StreamRow& row = reader_.streams()[i];
      const bool chunks = gap.kind == log::GapRow::Kind::kChunks && row.source == gap.owner;
      const bool decisions = gap.kind == log::GapRow::Kind::kDecisions && row.id == gap.owner;
      if (chunks || decisions) contexts_[i]->set_gap(gap.after_chunk);
    }
  }
  return {};
}

const ReplayStream& Replay::stream(std::uint32_t stream) const {
  return contexts_[stream]->stream();
}

std::optional<std::uint64_t> Replay::broken_at(std::uint32_t stream) const {
  return contexts_[stream]->broken_at();
}

void Replay::before(const pipeline::Item& item, std::uint32_t index) noexcept {
  while (const Schedule::Entry* entry = schedule_.due(item, index)) apply(*entry);
}

void Replay::apply(const Schedule::Entry& entry) noexcept {
  // The row was already checked; decoding it again here saves several times the memory of keeping
  // all decoded decisions.
  if (const auto decision = record::decision_of(entry.row, {}))
    contexts_[entry.stream]->apply(*decision);
}

const pipeline::StreamEngine& Replay::engine(std::uint32_t stream) const {
  return contexts_[stream]->engine();
}

Result<> Replay::run(const Out& out, const Pace& pace) {
  out_ = &out;
  const auto& streams = reader_.streams();
  for (;;) {
    const auto chunk = reader_.next_chunk();
    if (!chunk) return std::unexpected(chunk.error());
    if (!chunk->has_value()) break;
    if (!pace(**chunk)) return {};
    for (const auto& context : contexts_) context->apply_gap((*chunk)->id);
    const auto stream = std::ranges::find(streams, (*chunk)->source, &log::StreamRow::source);
    if (stream == streams.end()) continue;  // a source without a body
    ReplayStreamContext& context = *contexts_[static_cast<std::size_t>(stream - streams.begin())];
    if (auto fed = context.feed(**chunk); !fed) return fed;
  }
  for (const auto& context : contexts_)
    context->apply_gap(std::numeric_limits<std::int64_t>::max());
  while (const Schedule::Entry* entry = schedule_.rest()) apply(*entry);
  for (const auto& context : contexts_) {
    if (auto done = context->finish(!reader_.counts_items()); !done) return done;
  }
  return {};
}

}  // namespace posed::replay
