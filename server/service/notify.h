#pragma once

#include <string>

namespace radbake::service {

/// Tells the service manager how the program is doing: "READY=1", "STOPPING=1", "STATUS=...". Sent to the socket that
/// the environment's NOTIFY_SOCKET names (systemd's Type=notify); nothing happens where there is none.
void notify_service_manager(const std::string& message);

}  // namespace radbake::service
