// Models that arrive in pieces, with every mistake that a client can make.
#include <catch2/catch.hpp>

#include "daemon/control/uploads.hpp"
#include "proto/frame/time.hpp"
#include "proto/log/digest.hpp"

namespace posed::control {
namespace {

struct Sender {
  std::string model;
  std::string sha256 = log::sha256_hex(std::as_bytes(std::span(model)));

  [[nodiscard]] ModelPiece piece(std::size_t offset, std::size_t size) const {
    return {.stream = "walker",
            .sha256 = sha256,
            .total = model.size(),
            .offset = offset,
            .bytes = std::string_view(model).substr(offset, size)};
  }
};

TEST_CASE("a model in pieces is put together, for two clients at the same time") {
  Uploads uploads;
  const Sender sender{.model = std::string(100, 'm')};
  for (std::size_t offset = 0; offset < 80; offset += 20) {
    for (const char* client : {"a", "b"}) {
      const auto taken = uploads.add(client, sender.piece(offset, 20), 1);
      REQUIRE(taken);
      CHECK_FALSE(*taken);
    }
  }
  CHECK(uploads.bytes() == 160);
  CHECK(uploads.add("a", sender.piece(80, 20), 1).value() == sender.model);
  CHECK(uploads.add("b", sender.piece(80, 20), 1).value() == sender.model);
  CHECK(uploads.bytes() == 0);
}

TEST_CASE("pieces out of order, overlapping, beyond the end or of another model end the upload") {
  const Sender sender{.model = std::string(100, 'm')};
  const Sender other{.model = std::string(100, 'o')};
  for (ModelPiece wrong : {sender.piece(40, 20), sender.piece(10, 20), other.piece(20, 20)}) {
    Uploads uploads;
    REQUIRE(uploads.add("a", sender.piece(0, 20), 1));
    CHECK_FALSE(uploads.add("a", wrong, 1));
    CHECK(uploads.bytes() == 0);
    CHECK_FALSE(uploads.add("a", sender.piece(20, 20), 1));  // the error has ended the upload
  }
  Uploads uploads;
  ModelPiece beyond = sender.piece(0, 20);
  beyond.total = 10;
  CHECK_FALSE(uploads.add("a", beyond, 1));
  for (const std::uint64_t total : {std::uint64_t{0}, kMaxModel + 1, ~std::uint64_t{0}}) {
    ModelPiece absurd = sender.piece(0, 20);
    absurd.total = total;
    CHECK_FALSE(uploads.add("a", absurd, 1));
  }
  ModelPiece last = sender.piece(20, 20);
  last.offset = ~std::uint64_t{0} - 10;
  REQUIRE(uploads.add("a", sender.piece(0, 20), 1));
  CHECK_FALSE(uploads.add("a", last, 1));
  CHECK(uploads.bytes() == 0);
}

TEST_CASE("a damaged model is refused before it is parsed") {
  Uploads uploads;
  const Sender sender{.model = std::string(30, 'm'), .sha256 = std::string(64, '0')};
  const auto taken = uploads.add("a", sender.piece(0, 30), 1);
  REQUIRE_FALSE(taken);
  CHECK(taken.error().message.find("sha256") != std::string::npos);
}

TEST_CASE("uploads are bounded in number, bytes and time") {
  Uploads uploads;
  const Sender sender{.model = std::string(kMaxModel, 'm')};
  for (std::size_t i = 0; i < kMaxUploads; ++i) {
    REQUIRE(uploads.add(std::to_string(i), sender.piece(0, kMaxPiece), 1));
  }
  CHECK_FALSE(uploads.add("one more", sender.piece(0, kMaxPiece), 1));
  // All of them together may not hold more bytes than one model of the largest size.
  std::size_t offset = kMaxPiece;
  bool refused = false;
  for (; offset < kMaxModel && !refused; offset += kMaxPiece) {
    for (std::size_t i = 0; i < kMaxUploads; ++i) {
      refused |= !uploads.add(std::to_string(i), sender.piece(offset, kMaxPiece), 1);
    }
    CHECK(uploads.bytes() <= kMaxModel);
  }
  CHECK(refused);
  CHECK(uploads.forget_old(2) > 2);
  CHECK(uploads.forget_old(1 + nanoseconds(kUploadPause_s)) ==
        std::numeric_limits<std::int64_t>::max());
  CHECK(uploads.bytes() == 0);
  CHECK(uploads.add("one more", sender.piece(0, kMaxPiece), 1));
}

}  // namespace
}  // namespace posed::control
