# SPDX-License-Identifier: BSD-3-Clause
# Run by cmake --install and CPack, when the prefix is final: the unit, which names it, and the configuration, which
# is never overwritten.
if(CMAKE_INSTALL_PREFIX MATCHES "^/usr(/local)?/?$")
  set(config_folder /etc/outcrop)
else()
  set(config_folder ${CMAKE_INSTALL_PREFIX}/etc/outcrop)
endif()
set(bindir ${CMAKE_INSTALL_PREFIX}/${outcrop_bindir})
set(staging ${outcrop_binary}/install_service)

configure_file(${outcrop_source}/daemon/service/outcropd.service.in ${staging}/outcropd.service @ONLY)
file(INSTALL ${staging}/outcropd.service DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system)

# Debian's form of the licence: indented, a dot for an empty line.
file(READ ${outcrop_source}/LICENSE license)
string(STRIP "${license}" license)
string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
string(REPLACE "\n" "\n " license " ${license}")
configure_file(${outcrop_source}/tools/package/copyright ${staging}/copyright @ONLY)
file(INSTALL ${staging}/copyright DESTINATION ${CMAKE_INSTALL_PREFIX}/${outcrop_license_folder})

if(EXISTS $ENV{DESTDIR}${config_folder}/outcropd.yaml)
  message(STATUS "Kept: $ENV{DESTDIR}${config_folder}/outcropd.yaml")
else()
  file(INSTALL ${outcrop_source}/docs/outcropd.yaml DESTINATION ${config_folder})
endif()
