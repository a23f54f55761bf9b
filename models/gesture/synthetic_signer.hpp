// Synthetic signers: simulated people with a simulated glove who make gestures, for the demo and
// for tests that must run without recordings (models/gesture/README.md, "Synthetic signer"). A
// gesture is a move into a pose and a hold:
//   - poses: fist g, scissors c, open hand p, and 1 (index), 3 (index to ring), 4 (all but thumb),
//     from two or three stances of a finger (closed, straight, straight and spread);
//   - a person: how far each joint closes (+-8 %), a carriage of +-3 degrees a channel, pace
//     (+-10 %), and which fingers go first (+-50 ms);
//   - a gesture: minimum-jerk moves of 0.4 to 0.7 s, holds of 1.1 to 1.9 s, each finger closing a
//     little more or less than the last time, slow drift while holding;
//   - the glove: 19 sensors where a CyberGlove has them (other channels are 0), white noise, and a
//     dead band: a sensor moves on only when its value left the last one by more than the band.
// The motion is not anatomically correct, but its truth is known. Deterministic; cold.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "models/gesture/recording.hpp"
#include "proto/clip/label_file.hpp"

namespace posed::gesture {

struct SignerOptions {
  std::uint32_t person = 1;  // seeds everything personal and the randomness of the performance
  // The labels to perform, of g c p 1 3 4. Empty: `gestures` random labels of g, c and p, never the
  // same twice in a row.
  std::vector<std::string> script{};
  int gestures = 100;
  double rate_hz = 30.0;
  double noise_deg = 0.3;      // of each sensor, white, standard deviation
  double dead_band_deg = 0.5;  // 0: none
};

struct Performance {
  clip::HandClip clip;
  std::vector<clip::LabelSegment> labels;  // each from the start of its move to the next one's
};

// Returns an error for a label other than g c p 1 3 4.
Result<Performance> make_performance(const SignerOptions& options);

}  // namespace posed::gesture
