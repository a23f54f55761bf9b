// A strip: poses side by side on a ground line with a mark each half metre, as the figures of the
// papers show motions (Sato et al., figures 3 to 6; Takamido et al., figures 5 and 6). Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/tools/picture/figure.hpp"

namespace posed::picture {

struct StripPose {
  Figure figure;
  std::string caption;  // below the pose: "0.40 s"
};

// One row of poses, all of the same motion.
struct StripRow {
  std::string title;  // above the row; may be empty
  bool pale = false;  // grey, as the motion that another row is compared with
  std::vector<StripPose> poses;
};

struct StripText {
  std::string title;     // of the picture
  std::string sentence;  // below the rows: what is to be seen
};

// Sizes that hold all poses it was made for. The pictures of a video share one.
struct StripLayout {
  double px_per_m = 1.0;
  // The room that a pose needs around Figure::place_m; the ground is at the bottom.
  double left_m = 0.0, right_m = 0.0, bottom_m = 0.0, top_m = 0.0;
  bool ground = true;  // a hand has none
};

// `height_px`: of a row. The rows are not empty.
[[nodiscard]] StripLayout layout_of(const std::vector<StripRow>& rows, const Camera& camera,
                                    double height_px, bool ground);

// The picture as SVG elements, which have the classes title, row, time, see and ground.
struct StripDrawing {
  double width_px = 0.0, height_px = 0.0;
  std::string elements;
};
[[nodiscard]] StripDrawing draw_strip(const std::vector<StripRow>& rows, const Camera& camera,
                                      const StripLayout& layout, const StripText& text);

// The same as an SVG file.
[[nodiscard]] std::string strip_svg(const std::vector<StripRow>& rows, const Camera& camera,
                                    const StripLayout& layout, const StripText& text);

}  // namespace posed::picture
