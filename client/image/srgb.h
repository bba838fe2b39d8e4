#pragma once

namespace radbake::image {

/// sRGB's transfer curve, 0..1 to 0..1 (also above). Source: IEC 61966-2-1.
double srgb_to_linear(double encoded);
double linear_to_srgb(double linear);

}  // namespace radbake::image
