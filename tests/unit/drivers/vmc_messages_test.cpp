// OSC and the messages of the VMC protocol: byte by byte, beside oscpack as an independent reader,
// and with damage.
#include <catch2/catch.hpp>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <oscpack/osc/OscOutboundPacketStream.h>
#include <oscpack/osc/OscReceivedElements.h>

#include "drivers/vmc/emulator.hpp"
#include "drivers/vmc/messages.hpp"
#include "drivers/vmc/osc.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/vmc_rig.hpp"

namespace posed::drivers {
namespace {

using test::Bytes;
using vmc::DatagramWriter;
using vmc::Packing;

Bytes bytes_from_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3) {
    bytes.push_back(static_cast<std::byte>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

// All addresses, and the arguments up to one of a type that VMC does not use, as text.
using Messages = std::vector<std::string>;

void read_by_oscpack(const osc::ReceivedMessage& message, Messages& read) {
  std::string text = message.AddressPattern();
  for (auto at = message.ArgumentsBegin(); at != message.ArgumentsEnd(); ++at) {
    if (!at->IsString() && !at->IsInt32() && !at->IsFloat()) break;
    text += ' ';
    if (at->IsString()) text += at->AsString();
    if (at->IsInt32()) text += std::to_string(at->AsInt32());
    if (at->IsFloat()) text += std::to_string(at->AsFloat());
  }
  read.push_back(std::move(text));
}
void read_by_oscpack(const osc::ReceivedBundle& bundle, Messages& read) {
  for (auto at = bundle.ElementsBegin(); at != bundle.ElementsEnd(); ++at) {
    try {
      if (at->IsBundle()) {
        read_by_oscpack(osc::ReceivedBundle(*at), read);
      } else {
        read_by_oscpack(osc::ReceivedMessage(*at), read);
      }
    } catch (const osc::Exception&) {  // broken: the bundle says where the next one begins
    }
  }
}
Messages read_by_oscpack(std::span<const std::byte> packet) {
  const osc::ReceivedPacket received(reinterpret_cast<const char*>(packet.data()), packet.size());
  Messages read;
  if (received.IsBundle()) {
    read_by_oscpack(osc::ReceivedBundle(received), read);
  } else {
    read_by_oscpack(osc::ReceivedMessage(received), read);
  }
  return read;
}

// `all`: none was passed over.
struct ReadByPosed {
  Messages messages;
  bool all = false;
};
ReadByPosed read_by_posed(std::span<const std::byte> packet) {
  ReadByPosed read;
  read.all = vmc::each_message(packet, [&](const vmc::OscMessage& message) {
    std::string text(message.address);
    vmc::OscArguments arguments(message);
    for (const char type : message.types) {
      if (type != 's' && type != 'i' && type != 'f') break;
      text += ' ';
      if (type == 's') text += arguments.text();
      if (type == 'i') text += std::to_string(static_cast<int>(arguments.number()));
      if (type == 'f') text += std::to_string(arguments.f32());
    }
    CHECK(arguments.ok());
    read.messages.push_back(std::move(text));
  });
  return read;
}

// Whether oscpack reads the same; where posed passed some over, whether it reads the others.
bool agree(const ReadByPosed& posed, const Messages& oscpack) {
  if (posed.all) return posed.messages == oscpack;
  auto at = oscpack.begin();
  for (const std::string& message : posed.messages) {
    at = std::find(at, oscpack.end(), message);
    if (at == oscpack.end()) return false;
    ++at;
  }
  return true;
}

// The datagrams of one frame of the emulator.
std::vector<Bytes> one_vmc_frame(Packing packing) {
  vmc::VmcEmulator emulator(60.0, packing);
  return test::vmc_burst(emulator);
}

}  // namespace

TEST_CASE("VMC messages have the bytes of the protocol") {
  DatagramWriter writer(Packing::kMessages);
  writer.start();
  CHECK(writer.loaded());
  // Unity's (0.25, 0, 0)
  CHECK(writer.bone(vmc::find_bone("LeftHand"), {-0.25F, 0, 0}, kIdentity));
  CHECK(writer.bone(vmc::find_bone("RightMiddleIntermediate"), {}, kIdentity));
  CHECK(writer.status({.loaded = true, .calibration = 3, .mode = 0, .tracking = false}));
  REQUIRE(writer.datagrams() == 4);
  CHECK(test::bytes_of(writer.datagram(0)) ==
        bytes_from_hex("2f 56 4d 43 2f 45 78 74 2f 4f 4b 00 2c 69 00 00 00 00 00 01"));
  CHECK(test::bytes_of(writer.datagram(1)) ==
        bytes_from_hex(
            "2f 56 4d 43 2f 45 78 74 2f 42 6f 6e 65 2f 50 6f 73 00 00 00 2c 73 66 66 66 66 66 "
            "66 66 00 00 00 4c 65 66 74 48 61 6e 64 00 00 00 00 3e 80 00 00 00 00 00 00 00 00 "
            "00 00 00 00 00 00 00 00 00 00 00 00 00 00 3f 80 00 00"));
  std::size_t longest = 0;
  for (std::size_t bone = 0; bone < vmc::kBoneCount; ++bone) {
    writer.start();
    CHECK(writer.bone(bone, {}, kIdentity));
    longest = std::max(longest, writer.datagram(0).size());
  }
  CHECK(longest == 84);
}

TEST_CASE("the VMC bones are Unity's, parents first") {
  const auto& bones = vmc::bone_table();
  int named = 0;
  for (std::size_t i = 0; i < vmc::kBoneCount; ++i) {
    CHECK(vmc::find_bone(bones[i].name) == i);
    CHECK(bones[i].parent < static_cast<int>(i));
    CHECK((bones[i].parent == -1) == (i == vmc::kHips));
    if (bones[i].bone) ++named;
  }
  CHECK(named == kBones);
  CHECK(vmc::find_bone("hips") == vmc::kHips);
  CHECK(vmc::find_bone("HIPS") == vmc::kBoneCount);
  CHECK(vmc::find_bone("LastBone") == vmc::kBoneCount);
  CHECK(bones[vmc::find_bone("LeftThumbProximal")].bone == Bone::kLeftThumbMetacarpal);
  CHECK(bones[vmc::find_bone("RightLittleDistal")].bone == Bone::kRightLittleDistal);
}

TEST_CASE("VMC datagrams are packed as asked, and no bundle of several exceeds a network packet") {
  CHECK(one_vmc_frame(Packing::kOneBundle).size() == 1);
  CHECK(one_vmc_frame(Packing::kMessages).size() == 63);
  const auto bundles = one_vmc_frame(Packing::kBundles);
  CHECK(bundles.size() == 4);
  for (const Bytes& bundle : bundles) CHECK(bundle.size() <= 1472);
  DatagramWriter writer(Packing::kBundles);
  writer.start();
  CHECK_FALSE(writer.blend("", 1.0F));
  CHECK_FALSE(writer.blend(std::string(128, 'a'), 1.0F));
  CHECK_FALSE(writer.blend(std::string_view("a\0b", 3), 1.0F));
  CHECK(writer.datagrams() == 0);
  CHECK(writer.avatar(std::string(127, 'p'), std::string(127, 't')));
  const std::uint64_t before = test::allocations();
  int added = 0;
  while (writer.bone(1 + added % 54, {1, 2, 3}, kIdentity)) ++added;
  CHECK(test::allocations() == before);
  CHECK(added > 200);
  CHECK(writer.datagrams() > 10);
  for (std::size_t i = 0; i < writer.datagrams(); ++i) {
    CHECK(vmc::check_packet(writer.datagram(i)) == Outcome::kOk);
  }
}

TEST_CASE("oscpack reads from VMC datagrams what posed reads from them") {
  for (const Packing packing : {Packing::kOneBundle, Packing::kBundles, Packing::kMessages}) {
    Messages all;
    for (const Bytes& datagram : one_vmc_frame(packing)) {
      CHECK(vmc::check_packet(datagram) == Outcome::kOk);
      const ReadByPosed read = read_by_posed(datagram);
      CHECK(read.all);
      CHECK(read.messages == read_by_oscpack(datagram));
      all.insert(all.end(), read.messages.begin(), read.messages.end());
    }
    REQUIRE(all.size() == 63);
    CHECK(all.front().starts_with("/VMC/Ext/Root/Pos root "));
    CHECK(all[60] == "/VMC/Ext/Blend/Apply");
    CHECK(all[61] == "/VMC/Ext/OK 1 3 0 1");
    CHECK(all[62] == "/VMC/Ext/T 0.000000");
  }
}

TEST_CASE("every damaged OSC packet that posed accepts, oscpack reads alike") {
  std::mt19937 random(29);
  const std::vector<Bytes> good = one_vmc_frame(Packing::kBundles);
  int accepted = 0;
  int passed_over = 0;
  for (int round = 0; round < 20'000; ++round) {
    Bytes bad = good[random() % good.size()];
    bad.resize(4 * (1 + random() % 100));
    for (int flips = 0; flips <= round % 4; ++flips) {
      bad[random() % bad.size()] = static_cast<std::byte>(random() % 3 == 0 ? 0 : random());
    }
    if (vmc::check_packet(bad) != Outcome::kOk) continue;
    const ReadByPosed read = read_by_posed(bad);
    ++(read.all ? accepted : passed_over);
    CHECK(agree(read, read_by_oscpack(bad)));
  }
  CHECK(accepted > 100);
  CHECK(passed_over > 100);
}

TEST_CASE("an OSC packet that is cut anywhere is refused") {
  for (const Packing packing : {Packing::kOneBundle, Packing::kMessages}) {
    const Bytes whole = one_vmc_frame(packing).front();
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const auto cut = std::span(whole).first(size);
      const Outcome outcome = vmc::check_packet(cut);
      // A bundle may end between two messages, a message after its address.
      if (outcome == Outcome::kOk) CHECK(agree(read_by_posed(cut), read_by_oscpack(cut)));
      if (size % 4 != 0) CHECK(outcome != Outcome::kOk);
    }
  }
}

TEST_CASE("OSC sizes and bundles that make no sense are refused") {
  const Bytes message = test::vmc_message([](DatagramWriter& w) { w.loaded(); });
  CHECK(vmc::check_packet(test::bundle_of({message, message})) == Outcome::kOk);
  CHECK(vmc::check_packet(test::bundle_of({})) == Outcome::kOk);
  for (const unsigned size : {0U, 1U, 4U, 19U, 24U, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFECU}) {
    Bytes bundle = test::bundle_of({message});
    for (std::size_t i = 0; i < 4; ++i)
      bundle[16 + i] = static_cast<std::byte>(size >> (24 - 8 * i));
    INFO(size);
    CHECK(vmc::check_packet(bundle) == Outcome::kShort);
  }
  Bytes nested = message;
  for (int depth = 1; depth <= 20; ++depth) {
    nested = test::bundle_of({nested});
    CHECK((vmc::check_packet(nested) == Outcome::kOk) == (depth <= vmc::kMaxBundleDepth));
  }
  Bytes deep;
  while (deep.size() < 60'000) deep = test::bundle_of({deep});
  CHECK(vmc::check_packet(deep) == Outcome::kShort);
  CHECK(vmc::check_packet({}) == Outcome::kForeign);
  CHECK(vmc::check_packet(bytes_from_hex("23 62 75 6e 64 6c 65 00 00 00 00 00 ")) ==
        Outcome::kShort);
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 63 ")) == Outcome::kShort);  // no zero
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 2c 69 00 00 ")) ==
        Outcome::kShort);  // no i32
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 2c 78 00 00 ")) ==
        Outcome::kShort);  // type x
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 69 00 00 00 ")) ==
        Outcome::kShort);  // no comma
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 2c 62 00 00 ff ff ff fe ")) ==
        Outcome::kShort);
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 2c 62 00 00 00 00 00 02 01 02 00 00 ")) ==
        Outcome::kOk);
  CHECK(vmc::check_packet(bytes_from_hex("2f 61 62 00 ")) == Outcome::kOk);  // without types
  CHECK(vmc::check_packet(bytes_from_hex("01 02 03 04 ")) == Outcome::kForeign);
}

TEST_CASE("OSC: an array in a message that is not VMC's does no harm to the bundle") {
  std::array<char, 256> memory{};
  osc::OutboundPacketStream packet(memory.data(), memory.size());
  packet << osc::BeginBundleImmediate << osc::BeginMessage("/list") << osc::BeginArray
         << osc::int32{1} << osc::BeginArray << 2.5F << osc::EndArray << osc::EndArray
         << osc::EndMessage << osc::BeginMessage("/VMC/Ext/T") << 0.5F << osc::EndMessage
         << osc::EndBundle;
  const std::span bytes(reinterpret_cast<const std::byte*>(packet.Data()), packet.Size());
  REQUIRE(vmc::check_packet(bytes) == Outcome::kOk);
  float time_s = 0.0F;
  vmc::each_message(bytes, [&](const vmc::OscMessage& message) {
    if (message.address == "/VMC/Ext/T") time_s = vmc::OscArguments(message).f32();
  });
  CHECK(time_s == 0.5F);
}

TEST_CASE("OSC: a message of a bundle that cannot be read is passed over") {
  Bytes message = test::vmc_message([](DatagramWriter& w) { w.loaded(); });
  for (const std::string broken : {"2f 61 62 00 2c 78 00 00 00 00 00 01 ",  // type x
                                   "2f 61 62 00 2c 69 00 00 ",              // no i32
                                   "2f 61 62 00 69 00 00 00 ",              // no comma
                                   "01 02 03 04 "}) {
    INFO(broken);
    const Bytes inner = test::bundle_of({bytes_from_hex(broken)});
    const Bytes bundle = test::bundle_of({message, bytes_from_hex(broken), inner, message});
    CHECK(vmc::check_packet(bundle) == Outcome::kOk);
    int read = 0;
    CHECK_FALSE(vmc::each_message(bundle, [&](const vmc::OscMessage& each) {
      CHECK(each.address == "/VMC/Ext/OK");
      ++read;
    }));
    CHECK(read == 2);
  }
}

TEST_CASE("OSC: any number is a number, a text is none, and what is missing is told") {
  std::array<char, 256> memory{};
  osc::OutboundPacketStream packet(memory.data(), memory.size());
  packet << osc::BeginMessage("/VMC/Ext/Bone/Pos") << "hips" << 1.5 << osc::int32{-2}
         << osc::int64{7} << 0.25F << true << false << "end" << osc::EndMessage;
  const std::span bytes(reinterpret_cast<const std::byte*>(packet.Data()), packet.Size());
  REQUIRE(vmc::check_packet(bytes) == Outcome::kOk);
  vmc::each_message(bytes, [](const vmc::OscMessage& message) {
    vmc::OscArguments arguments(message);
    CHECK(arguments.text() == "hips");
    for (const double expected : {1.5, -2.0, 7.0, 0.25, 1.0, 0.0}) {
      CHECK(arguments.number() == expected);
    }
    CHECK(arguments.ok());
    CHECK(arguments.number() == 0.0);  // a text
    CHECK_FALSE(arguments.ok());
  });
}

}  // namespace posed::drivers
