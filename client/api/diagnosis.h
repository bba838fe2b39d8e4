#pragma once

#include <string>

#include "client/api/client.h"

namespace radbake::api {

/// Why a connection to a server did not come about, where TLS is the reason: another handshake, by hand, as gRPC keeps
/// the reason for itself. In words that name the option to look at; empty where nothing is found.
/// Takes a few seconds at most.
///
/// `target`: HOST:PORT or unix:PATH.
std::string diagnose_tls(const std::string& target, const ClientSecurity& security);

}  // namespace radbake::api
