#include "common/base/version.h"

namespace radbake {

const char* const kEngineVersion = RADBAKE_VERSION;

}  // namespace radbake
