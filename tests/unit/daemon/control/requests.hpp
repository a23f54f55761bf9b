// Control requests that several tests send.
#pragma once

#include <span>
#include <string>

#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"

namespace posed::control {

inline v1::ControlRequest alpha_request(const std::string& stream, float alpha) {
  v1::ControlRequest request;
  request.mutable_set_parameter()->set_stream(stream);
  request.mutable_set_parameter()->set_name("alpha");
  request.mutable_set_parameter()->set_number(alpha);
  return request;
}

// A model that fits into one piece.
inline v1::ControlRequest model_request(const std::string& stream, const std::string& bytes) {
  v1::ControlRequest request;
  auto& part = *request.mutable_model_part();
  part.set_stream(stream);
  part.set_sha256(log::sha256_hex(std::as_bytes(std::span(bytes))));
  part.set_total(bytes.size());
  part.set_bytes(bytes);
  part.set_name("sway.style");
  return request;
}

}  // namespace posed::control
