#include "daemon/tools/replay/replay.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "daemon/record/decision_code.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
Replay::Replay(log::Reader& reader) : reader_(reader), models_(reader) {}

Result<std::unique_ptr<Replay>> Replay::open(log::Reader& reader, bool every_raw) {
  std::unique_ptr<Replay> replay(new Replay(reader));
  TRY(replay->open_contexts(every_raw));
  TRY(replay->open_sources());
  TRY(replay->load_descriptions());
  TRY(replay->build_streams());
  TRY(replay->load_decisions());
  TRY(replay->load_gaps());
  for (const auto& context : replay->contexts_) context->ready();
  return replay;
}

Result<> Replay::open_contexts(bool every_raw) {
  const auto& streams = reader_.streams();
  if (streams.size() > log::kMaxStreams) {
    return fail("holds " + std::to_string(streams.size()) + " streams, and this posed replays " +
                    std::to_string(log::kMaxStreams) + " at most",
                reader_.file());
  }
  for (const log::StreamRow& row : streams) {
    const auto index = static_cast<std::uint32_t>(contexts_.size());
    auto context = TRY(ReplayStreamContext::open(index, reader_.source_of(row), row, models_, *this,
                                                 reader_.file()));
    if (every_raw) context->give_raw();
    contexts_.push_back(std::move(context));
  }
  routes.reserve(contexts_.size());
  return {};
}

Result<> Replay::open_sources() {
  for (const log::SourceRow& row : reader_.sources()) {
    auto& source = sources_.emplace_back();
    std::vector<ReplayStreamContext*> streams;
    for (std::size_t i = 0; i < contexts_.size(); ++i) {
      if (reader_.streams()[i].source == row.id) streams.push_back(contexts_[i].get());
    }
    if (streams.empty()) continue;  // nothing of it was published
    source = TRY(ReplaySource::open(row, std::move(streams), *this, reader_.file()));
  }
  return {};
}

Result<> Replay::build_streams() {
  std::vector<Built> built(contexts_.size(), Built::kNo);
  for (std::size_t i = 0; i < contexts_.size(); ++i) {
    TRY(build_stream(i, built));
  }
  return {};
}

// Those that the stream's stages have as partners are built before it.
Result<> Replay::build_stream(std::size_t stream, std::vector<Built>& built) {
  ReplayStreamContext& context = *contexts_[stream];
  if (!context.stream().described || built[stream] == Built::kYes) return {};
  if (built[stream] == Built::kUnderWay) {
    return fail("the log is damaged (stream " + in_quotes(context.stream().name) +
                    " has itself as a partner); use another copy of it",
                reader_.file());
  }
  built[stream] = Built::kUnderWay;
  std::vector<const ReplayStreamContext*> partners;
  for (std::size_t i = 0; i < contexts_.size(); ++i) {
    if (!context.has_partner(*contexts_[i]) || !contexts_[i]->stream().described) continue;
    TRY(build_stream(i, built));
    partners.push_back(contexts_[i].get());
  }
  built[stream] = Built::kYes;
  return context.build(partners);
}

Result<> Replay::load_descriptions() {
  return reader_.each_description([this](const log::ChunkRow& row) -> Result<> {
    ReplaySource* const source = source_of(row.source);
    return source == nullptr ? Result<>() : source->expect(row);
  });
}

ReplaySource* Replay::source_of(std::uint32_t log_id) const {
  const auto& rows = reader_.sources();
  const auto found = std::ranges::lower_bound(rows, log_id, {}, &log::SourceRow::id);
  return sources_[found - rows.begin()].get();
}

Result<> Replay::load_decisions() {
  auto rows = TRY(reader_.decisions());
  for (log::DecisionRow& row : rows) {
    const auto decision = TRY(record::decision_of(row, reader_.file()));
    const std::size_t stream = *reader_.place_of_stream(row.stream);
    TRY(contexts_[stream]->expect(decision));
    schedule_.add({stream, std::move(row)});
  }
  return {};
}

Result<> Replay::load_gaps() {
  const auto gaps = TRY(reader_.gaps());
  for (const log::GapRow& gap : gaps) {
    for (std::size_t i = 0; i < contexts_.size(); ++i) {
      const log::StreamRow& row = reader_.streams()[i];
      const bool chunks = gap.kind == log::GapRow::Kind::kChunks && row.source == gap.owner;
      const bool decisions = gap.kind == log::GapRow::Kind::kDecisions && row.id == gap.owner;
      if (chunks || decisions) set_gap(i, gap.after_chunk);
    }
    if (gap.kind != log::GapRow::Kind::kChunks) continue;
    if (ReplaySource* const source = source_of(gap.owner)) source->set_gap(gap.after_chunk);
  }
  for (const auto& context : contexts_) gapped_.push_back(context.get());
  return {};
}

// What a stream publishes also depends on the partners of its stages, and on theirs.
void Replay::set_gap(std::size_t stream, std::int64_t after_chunk) {
  contexts_[stream]->set_gap(after_chunk);
  for (std::size_t i = 0; i < contexts_.size(); ++i) {
    if (contexts_[i]->needs(contexts_[stream]->index())) set_gap(i, after_chunk);
  }
}

void Replay::apply_gaps(std::int64_t chunk) {
  std::erase_if(gapped_, [&](ReplayStreamContext* stream) { return stream->apply_gap(chunk); });
}

const ReplayStream& Replay::stream(std::uint32_t stream) const {
  return contexts_[stream]->stream();
}

std::optional<std::uint64_t> Replay::broken_at(std::uint32_t stream) const {
  return contexts_[stream]->broken_at();
}

void Replay::before(const pipeline::Item& item, std::uint32_t /*stream*/) noexcept {
  while (const Schedule::Entry* entry = schedule_.due(item.number)) {
    apply(*entry);
  }
  position_ = item.number;
}

void Replay::reach(std::uint64_t item) noexcept {
  while (const Schedule::Entry* entry = schedule_.due(item)) apply(*entry);
}

void Replay::apply(const Schedule::Entry& entry) noexcept {
  // The row was already checked; decoding it again here saves several times the memory of keeping
  // all decoded decisions.
  if (const auto decision = record::decision_of(entry.row, {}))
    contexts_[entry.stream]->apply(*decision);
}

const pipeline::StreamEngine* Replay::engine(std::uint32_t stream) const {
  return contexts_[stream]->engine();
}

Result<> Replay::run(const Out& out, const Pace& pace) {
  out_ = &out;
  for (;;) {
    const auto chunk = TRY(reader_.next_chunk());
    if (!chunk.has_value()) break;
    if (!pace(*chunk)) return {};
    apply_gaps(chunk->id);
    ReplaySource* const source = source_of(chunk->source);
    if (source == nullptr) continue;
    TRY(source->feed(*chunk));
    if (error_) return std::unexpected(*error_);
  }
  apply_gaps(std::numeric_limits<std::int64_t>::max());
  while (const Schedule::Entry* entry = schedule_.rest()) apply(*entry);
  for (const auto& context : contexts_) context->finish();
  if (error_) return std::unexpected(*error_);
  return {};
}

}  // namespace posed::replay
