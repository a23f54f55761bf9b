// NatNet: any bytes as the payload of each message, in any version, and as a description. The first
// byte selects the version, the rest is the payload.
#include <array>
#include <cstdint>
#include <string>

#include "drivers/driver.hpp"
#include "drivers/natnet/encode.hpp"
#include "drivers/natnet/figure.hpp"
#include "tests/fuzz/session.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace {

using posed::fuzz::demand;
using posed::fuzz::feed;
namespace natnet = posed::drivers::natnet;
using posed::test::CollectSink;

void check(const CollectSink& sink, const posed::drivers::SourceLayout& layout) {
  for (const std::size_t body : sink.bodies) demand(body < layout.bodies.size());
  for (const std::size_t body : sink.sample_bodies) demand(body < layout.bodies.size());
  posed::fuzz::demand_valid(sink);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array<const char*, 8> kVersions{"",    "2.5", "2.6", "2.7",
                                                 "2.9", "3.0", "4.0", "4.1"};
  if (size < 1 || size > 60'000) return 0;
  const std::span bytes = std::as_bytes(std::span(data + 1, size - 1));
  const posed::drivers::Driver& driver = *posed::drivers::find_driver("natnet");
  const std::string version = kVersions[data[0] % kVersions.size()];
  const auto description = driver.expect({{"version", version}});
  demand(description.has_value());
  const auto decoder = driver.make_decoder(*description).value();
  static const auto bodies = driver.make_layout(
      natnet::encode_description(natnet::emulated_model(), {3, 0}, {.version = {3, 0}}));
  demand(bodies.has_value());
  decoder->use(**bodies);
  CollectSink sink(0);
  feed(*decoder, bytes, 0, sink);
  for (const auto id :
       {natnet::MessageId::kFrame, natnet::MessageId::kServerInfo, natnet::MessageId::kResponse,
        natnet::MessageId::kModelDef, natnet::MessageId::kFrame}) {
    feed(*decoder, natnet::encode_message(id, bytes), 0, sink);
    (void)decoder->next_request(0);
  }
  check(sink, **bodies);
  // What a client sends to the server.
  natnet::Message request;
  (void)natnet::decode_request(bytes, request);
  const natnet::Version wanted = natnet::version_for(bytes);
  demand(wanted >= natnet::Version{2, 9} && wanted <= natnet::Version{4, 1});
  (void)natnet::read_version({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const auto any = driver.make_layout(bytes);
  if (!any) return 0;
  demand((*any)->bodies.size() <= posed::kMaxBodies);
  decoder->use(**any);
  sink.clear();
  feed(*decoder, natnet::encode_message(natnet::MessageId::kFrame, bytes), 0, sink);
  check(sink, **any);
  return 0;
}
