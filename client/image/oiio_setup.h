#pragma once

namespace radbake::image {

/// Sets OpenImageIO's process-wide limits once: sizes, and no threads of its own (files must not depend on them).
void set_up_oiio();

}  // namespace radbake::image
