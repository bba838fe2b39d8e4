#include "server/service/access_options.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "server/access/token_set.h"

namespace radbake::service {

void declare_access_options(CLI::App& app, access::AccessOptions& options) {
  app.add_option("--tls-cert", options.tls.certificate, "Speak TLS with this certificate and its chain (PEM)")
      ->type_name("FILE");
  app.add_option("--tls-key", options.tls.key, "Its private key (PEM, without a password)")->type_name("FILE");
  app.add_option("--tls-client-ca", options.tls.client_ca,
                 "Clients show certificates that these authorities signed: CN is the tenant, OU=admin an admin")
      ->type_name("FILE");
  app.add_option("--tokens", options.tokens,
                 "Clients show bearer tokens: one 'SHA256 TENANT ROLE' a line, ROLE submit or admin")
      ->type_name("FILE");
  app.add_flag("--insecure-listen", options.allows_insecure_listen,
               "Listen where other machines can connect without TLS or without knowing who calls: only behind a proxy "
               "that does both");
}

void declare_call_limits(CLI::App& app, Limits& limits) {
  const auto declare = [&](const char* name, std::uint64_t& limit, const char* description) {
    app.add_option(name, limit, description)
        ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000}))
        ->capture_default_str()
        ->type_name("N");
  };
  declare("--max-connections", limits.max_connections, "Connections at the same time; one above is closed");
  declare("--max-calls-per-connection", limits.max_calls_per_connection, "Calls at the same time on one connection");
  declare("--max-uploads", limits.max_uploads, "Uploads at the same time; each holds a message of memory");
  declare("--max-uploads-per-tenant", limits.max_uploads_per_tenant, "Of one tenant");
  declare("--max-downloads", limits.max_downloads, "Downloads at the same time; each holds a chunk of memory");
  declare("--max-downloads-per-tenant", limits.max_downloads_per_tenant, "Of one tenant");
  declare("--max-watches", limits.max_watches, "Watches of bakes at the same time");
  declare("--max-watches-per-tenant", limits.max_watches_per_tenant, "Of one tenant");
}

int print_token_hash() {
  std::string token;
  std::getline(std::cin, token);
  const auto hash = access::hash_token(token);
  if (!hash.ok()) {
    std::cerr << "radbaked: --hash-token: " << hash.error().message << "\n";
    return 2;
  }
  std::cout << *hash << "\n";
  return 0;
}

}  // namespace radbake::service
