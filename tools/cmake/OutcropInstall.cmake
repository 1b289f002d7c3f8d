# SPDX-License-Identifier: BSD-3-Clause
# What cmake --install lays out, and the Debian package that CPack makes of it. Benches, soak and tests stay here.
include(GNUInstallDirs)
# Install what has been built; whoever calls names the targets.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)

set(OUTCROP_PROGRAMS outcropd outcrop-base outcrop-drive outcrop-eval outcrop-pose-replay)

function(outcrop_install)
  install(TARGETS ${OUTCROP_PROGRAMS} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})

  file(GLOB types CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/lcmtypes/*.lcm)
  install(FILES ${types} DESTINATION ${CMAKE_INSTALL_DATADIR}/outcrop/lcmtypes)
  foreach(section 5 8)
    file(GLOB pages CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/docs/man/*.${section})
    install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section})
  endforeach()
  file(GLOB documents CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/docs/*.md)
  install(FILES ${CMAKE_SOURCE_DIR}/LICENSE ${documents} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/outcrop)
  install(FILES ${CMAKE_SOURCE_DIR}/docs/outcrop-base.yaml ${CMAKE_SOURCE_DIR}/docs/outcropd.yaml
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/outcrop/examples)

  # The system's own folders are called lib whatever the libraries' is.
  install(FILES ${CMAKE_SOURCE_DIR}/daemon/service/60-outcrop.rules DESTINATION lib/udev/rules.d)
  install(FILES ${CMAKE_SOURCE_DIR}/daemon/service/outcrop.sysusers DESTINATION lib/sysusers.d RENAME outcrop.conf)
  install(CODE "set(outcrop_source \"${CMAKE_SOURCE_DIR}\")
set(outcrop_binary \"${CMAKE_BINARY_DIR}\")
set(outcrop_bindir \"${CMAKE_INSTALL_BINDIR}\")
set(outcrop_license_folder \"${CMAKE_INSTALL_DATADIR}/doc/outcrop\")")
  install(SCRIPT ${CMAKE_SOURCE_DIR}/tools/cmake/InstallService.cmake)
endfunction()

function(outcrop_package)
  set(OUTCROP_PACKAGE_MAINTAINER "The Outcrop authors <outcrop@package.invalid>" CACHE STRING
      "who answers for packages made here: NAME <ADDRESS>")
  set(control ${CMAKE_BINARY_DIR}/package_control)
  file(WRITE ${control}/conffiles "/etc/outcrop/outcropd.yaml\n")
  set(scripts)
  foreach(script postinst prerm postrm)
    configure_file(${CMAKE_SOURCE_DIR}/tools/package/${script} ${control}/${script} COPYONLY)
    list(APPEND scripts ${control}/${script})
  endforeach()

  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_NAME outcrop)
  set(CPACK_PACKAGE_VENDOR "The Outcrop authors")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "rehearse a vehicle's drive over a narrow radio link")
  set(CPACK_PACKAGE_DESCRIPTION "outcropd, on the vehicle, finds junctions in camera frames and sends them over LCM.
outcrop-base makes a model of obstacles and ground of them, and draws what the vehicle would see along a path.")
  set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/package)
  # Absolute destinations (/etc) are wanted, and the final prefix is in the unit.
  set(CPACK_SET_DESTDIR ON)
  set(CPACK_INSTALL_PREFIX /usr)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${OUTCROP_PACKAGE_MAINTAINER})
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
  # systemd-sysusers, and userdel on purging. outcrop-drive makes its network with ip, outcrop-base its video with ffmpeg.
  set(CPACK_DEBIAN_PACKAGE_DEPENDS "passwd, systemd")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "iproute2, udev")
  set(CPACK_DEBIAN_PACKAGE_SUGGESTS ffmpeg)
  set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${scripts} ${control}/conffiles)
  set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  include(CPack)
endfunction()

outcrop_install()
outcrop_package()
