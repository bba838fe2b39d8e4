// Linked into radbaked for tests: RADBAKE_FAILPOINT=NAME:K kills the server, as kill -9 does, when it comes to a
// failpoint for the K-th time. RADBAKE_FAILPOINT=list:FILE writes the names of the failpoints that it passes to a file.

#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <mutex>
#include <set>
#include <string>

#include "server/store/failpoint.h"

namespace radbake::tests {
namespace {

std::mutex g_mutex;
std::string g_name, g_list;
int g_left = 0;
std::set<std::string> g_passed;

void come_to(const char* name) {
  const std::lock_guard lock(g_mutex);
  if (!g_list.empty() && g_passed.insert(name).second) std::ofstream(g_list, std::ios::app) << name << std::endl;
  if (g_name == name && --g_left == 0) ::kill(::getpid(), SIGKILL);
}

const bool g_is_set = [] {
  const char* wanted = std::getenv("RADBAKE_FAILPOINT");
  if (wanted == nullptr) return false;
  const std::string text = wanted;
  const std::size_t colon = text.rfind(':');
  g_name = text.substr(0, colon);
  if (g_name == "list") {
    g_list = text.substr(colon + 1);
  } else {
    g_left = std::atoi(text.substr(colon + 1).c_str());
  }
  store::failpoint_hook = come_to;
  return true;
}();

}  // namespace
}  // namespace radbake::tests
