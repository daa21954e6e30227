#include "clients/tubectl/dds_options.hpp"

namespace tubed {

void add_dds_options(CLI::App& verb, Subscription& subscription) {
  const char* const heading = "Where to listen";
  verb.add_option("--domain", subscription.domain, "DDS domain of the daemon")
      ->check(CLI::Range(0, 230))
      ->capture_default_str()
      ->group(heading);
  verb.add_option("--partition", subscription.partition, "The room, as in the daemon's configuration")
      ->group(heading);
  verb.add_option("--interface", subscription.network_interface, "Network interface, name or address")
      ->capture_default_str()
      ->group(heading);
  verb.add_option("--instrument", subscription.instrument_id, "Only this instrument (default: all)")
      ->group(heading);
}

}  // namespace tubed
