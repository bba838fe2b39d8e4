#include "client/image/oiio_setup.h"

#include <OpenImageIO/imageio.h>

namespace radbake::image {

void set_up_oiio() {
  static const bool is_done = [] {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    OIIO::attribute("limits:channels", 16);
    OIIO::attribute("limits:imagesize_MB", 4096);
    return true;
  }();
  (void)is_done;
}

}  // namespace radbake::image
