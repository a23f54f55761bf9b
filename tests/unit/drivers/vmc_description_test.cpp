// How the VMC driver describes its performer: when, what, and what it makes of a damaged one.
#include <catch2/catch.hpp>

#include <random>

#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/vmc_rig.hpp"

namespace posed::drivers {
namespace {

using test::bundle_of;
using test::Bytes;
using test::raw_bone;
using test::raw_message;
using test::vmc_message;
using test::VmcSession;
using vmc::Packing;
using vmc::ValueKind;
using vmc::VmcEmulator;

}  // namespace

TEST_CASE("a VMC performer is described again when bones, positions or values change") {
  VmcEmulator emulator(60.0, Packing::kOneBundle);
  VmcSession session;
  std::int64_t now_ns = 0;
  const auto stream = [&](int frames) {
    for (int i = 0; i < frames; ++i) {
      now_ns = emulator.next_due_ns();
      session.feed(test::vmc_burst(emulator), now_ns);
    }
    return session.layouts.size();
  };
  CHECK(stream(60) == 1);
  emulator.set_size(1.01F);  // less than 5 mm
  CHECK(stream(60) == 1);
  emulator.set_size(1.1F);
  CHECK(stream(60) == 2);
  CHECK(session.body().skeleton->joints[1].offset_m.y() == Approx(0.077));
  emulator.leave_out(vmc::find_bone("Jaw"));
  CHECK(stream(40) == 2);  // perhaps it was only lost
  CHECK(session.sink.frames.back().valid[8]);
  CHECK(stream(40) == 3);
  CHECK(session.body().skeleton->joints.size() == 54);
  session.feed(raw_message("/VMC/Ext/VRM", "ss", "path", {}), now_ns);  // wrong
  session.feed(vmc_message([](auto& w) { w.avatar("C:\\a.vrm", "Alicia"); }), now_ns);
  CHECK(stream(30) == 3);  // a title alone changes no stream
  emulator.set_size(1.0F);
  CHECK(stream(60) == 4);
  CHECK(session.body().skeleton->name == "Alicia");
}

TEST_CASE("a VMC avatar that stretches all the time does not begin its stream all the time") {
  VmcEmulator emulator(60.0, Packing::kOneBundle);
  VmcSession session;
  for (int i = 0; i < 60 * 60; ++i) {
    emulator.set_size(i % 2 == 0 ? 1.0F : 1.3F);
    const std::int64_t now_ns = emulator.next_due_ns();
    session.feed(test::vmc_burst(emulator), now_ns);
  }
  CHECK(session.layouts.size() < 10);
}

TEST_CASE("a VMC performer goes on after a pause of the network") {
  for (const Packing packing : {Packing::kOneBundle, Packing::kBundles, Packing::kMessages}) {
    VmcEmulator emulator(60.0, packing);
    VmcSession session;
    for (int i = 0; i < 120; ++i) {
      const std::int64_t pause_ns = i < 60 ? 0 : 3 * kNanosPerSecond;
      const std::int64_t now_ns = emulator.next_due_ns() + pause_ns;
      session.feed(test::vmc_burst(emulator), now_ns);
    }
    CHECK(session.layouts.size() == 1);
    CHECK(session.sink.frames.size() > 110);
  }
}

TEST_CASE("a VMC performer whose model is not loaded leaves; without tracking its pose is held") {
  VmcEmulator emulator(60.0, Packing::kBundles);
  VmcSession session;
  const auto stream = [&](int frames) {
    session.sink.clear();
    for (int i = 0; i < frames; ++i) {
      const std::int64_t now_ns = emulator.next_due_ns();
      session.feed(test::vmc_burst(emulator), now_ns);
    }
  };
  stream(60);
  CHECK(session.sink.frames.back().quality == Quality::kMeasured);
  emulator.set_status({.tracking = false});
  stream(60);
  CHECK(session.sink.frames.size() == 60);
  CHECK(session.sink.frames.back().quality == Quality::kHeld);
  CHECK(session.sink.samples.back().quality == Quality::kHeld);
  emulator.set_status({.loaded = false});
  stream(90);
  CHECK(session.sink.frames.empty());
  CHECK(session.layouts.back()->bodies.empty());
  emulator.set_status({});
  stream(90);
  CHECK(session.layouts.size() == 3);
  CHECK(session.sink.frames.size() > 50);
  // Bones in spite of it describe nobody.
  session.feed(raw_message("/VMC/Ext/OK", "i", "", {0}), emulator.next_due_ns());
  const std::size_t before = session.sink.frames.size();
  session.feed(bundle_of({raw_bone("Hips", {0, 1, 0, 0, 0, 0, 1}),
                          vmc_message([](auto& w) { w.time(100.0F); })}),
               emulator.next_due_ns());
  CHECK(session.sink.frames.size() == before);
  CHECK(session.sink.count(Outcome::kForeign) > 0);
}

TEST_CASE("a damaged description of a VMC performer is refused with a sentence") {
  vmc::Described described;
  described.bones.set(vmc::kHips).set(vmc::find_bone("Head"));
  described.values[0] = {ValueKind::kTracker, "A"};
  described.value_count = 1;
  std::array<std::byte, vmc::kMaxDescribed> room{};
  const Bytes good = test::bytes_of(vmc::write_description(described, room));
  REQUIRE(find_driver("vmc")->make_layout(good));
  const auto refused = [](const Bytes& bytes) {
    const auto layout = find_driver("vmc")->make_layout(bytes);
    if (layout) return false;
    CHECK_FALSE(layout.error().message.empty());
    return layout.error().message.find('\n') == std::string::npos;
  };
  for (std::size_t size = 0; size < good.size(); ++size) {
    CHECK(refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}));
  }
  const auto changed = [&good](std::size_t at, unsigned value) {
    Bytes bytes = good;
    bytes[at] = static_cast<std::byte>(value);
    return bytes;
  };
  CHECK(refused(changed(0, 2)));
  CHECK(refused(changed(2, 200)));   // bones
  CHECK(refused(changed(3, 54)));    // not ascending
  CHECK(refused(changed(16, 55)));   // no such bone
  CHECK(refused(changed(7, 0x7F)));  // together with the next: a far position
  CHECK(refused(changed(good.size() - 3, 4)));
  CHECK(refused(changed(good.size() - 2, 0)));
  Bytes longer = good;
  longer.push_back({});
  CHECK(refused(longer));
  std::mt19937 random(5);
  for (int round = 0; round < 5000; ++round) {
    Bytes bad = good;
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    }
    const auto layout = find_driver("vmc")->make_layout(bad);
    if (layout && !(*layout)->bodies.empty()) CHECK((*layout)->bodies.size() == 1);
  }
}

TEST_CASE("describing a VMC performer does not allocate") {
  VmcEmulator emulator(60.0, Packing::kMessages);
  std::vector<std::pair<std::int64_t, Bytes>> datagrams;
  for (int i = 0; i < 300; ++i) {
    emulator.set_size(1.0F + 0.2F * static_cast<float>(i / 100));
    const std::int64_t now_ns = emulator.next_due_ns();
    for (Bytes& bytes : test::vmc_burst(emulator)) datagrams.emplace_back(now_ns, std::move(bytes));
  }
  VmcSession session;
  const std::uint64_t before = test::allocations();
  for (const auto& [now_ns, bytes] : datagrams) session.decoder->feed(bytes, now_ns, session.sink);
  CHECK(test::allocations() == before);
  CHECK(session.sink.descriptions == 3);
}

}  // namespace posed::drivers
