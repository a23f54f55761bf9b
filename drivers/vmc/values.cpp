#include "drivers/vmc/values.hpp"

#include <algorithm>

namespace posed::drivers::vmc {

RT_SAFE void Values::set(ValueKind kind, std::string_view name, std::span<const float> values,
                         std::int64_t arrival_ns) noexcept {
  Entry* entry = find(kind, name);
  if (entry == nullptr) entry = make(kind, name, arrival_ns);
  if (entry == nullptr) return;
  std::ranges::copy(values.first(values_of(kind)), entry->values.begin());
  entry->last_ns = last_ns_ = arrival_ns;
  entry->fresh = fresh_ = true;
}

RT_SAFE Values::Entry* Values::find(ValueKind kind, std::string_view name) noexcept {
  const auto known = std::span(entries_).first(count_);
  const auto found = std::ranges::find_if(
      known, [&](const Entry& entry) { return entry.kind == kind && entry.name() == name; });
  return found == known.end() ? nullptr : &*found;
}

// Null when there is no place.
RT_SAFE Values::Entry* Values::make(ValueKind kind, std::string_view name,
                                    std::int64_t now_ns) noexcept {
  if (name.empty() || name.size() > kMaxVmcName) return nullptr;
  Entry* entry = nullptr;
  if (count_ < entries_.size()) {
    entry = &entries_[count_++];
  } else {
    entry = &*std::ranges::min_element(entries_, {}, &Entry::last_ns);
    if (now_ns - entry->last_ns < kForgotten_ns) return nullptr;
  }
  *entry = Entry{};
  entry->kind = kind;
  std::ranges::copy(name, entry->text.begin());
  entry->size = name.size();
  if (layout_ != nullptr) entry->place = layout_->place_of(kind, name);
  if (entry->place == VmcLayout::kNone) new_ = true;
  return entry;
}

RT_SAFE void Values::use(const VmcLayout& layout) noexcept {
  layout_ = &layout;
  for (Entry& entry : std::span(entries_).first(count_)) {
    entry.place = layout.place_of(entry.kind, entry.name());
  }
}

RT_SAFE void Values::fill(Sample& sample) noexcept {
  sample.value_count = static_cast<std::uint16_t>(layout_ == nullptr ? 0 : layout_->value_count);
  for (Entry& entry : std::span(entries_).first(count_)) {
    const bool there = entry.kind == ValueKind::kBlend || entry.fresh;
    entry.fresh = false;
    if (entry.place == VmcLayout::kNone || !there) continue;
    for (std::size_t i = 0; i < values_of(entry.kind); ++i) {
      const std::size_t at = static_cast<std::size_t>(entry.place) + i;
      sample.value[at] = entry.values[i];
      sample.valid.set(at);
    }
  }
  fresh_ = false;
}

RT_SAFE void Values::describe(std::int64_t now_ns, Described& described) const noexcept {
  std::size_t values = 0;
  described.value_count = 0;
  for (const Entry& entry : std::span(entries_).first(count_)) {
    const std::size_t more = values_of(entry.kind);
    if (now_ns - entry.last_ns >= kForgotten_ns || values + more > kMaxVmcValues) continue;
    values += more;
    described.values[described.value_count++] = {entry.kind, entry.name()};
  }
}

}  // namespace posed::drivers::vmc
