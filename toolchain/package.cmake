# The filters for somebody else's project: tetap::base, filter, nav, model and slam are headers, with Eigen and C++20 as their only needs.
# No flag, no definition and no test goes with them. Same names from add_subdirectory() and from find_package(tetap).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
endif()

if(NOT PROJECT_IS_TOP_LEVEL)  # as find_package() sets it
  set(tetap_VERSION ${PROJECT_VERSION} PARENT_SCOPE)
endif()

set(TETAP_INCLUDE_DIR ${CMAKE_INSTALL_INCLUDEDIR}/tetap)
set(TETAP_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/tetap)
set(below Eigen3::Eigen)
foreach(floor base filter nav model slam)
  add_library(tetap_package_${floor} INTERFACE)
  add_library(tetap::${floor} ALIAS tetap_package_${floor})
  set_target_properties(tetap_package_${floor} PROPERTIES EXPORT_NAME ${floor})
  target_compile_features(tetap_package_${floor} INTERFACE cxx_std_20)
  target_include_directories(tetap_package_${floor} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(tetap_package_${floor} INTERFACE ${below})
  set(below tetap_package_${floor})
  install(TARGETS tetap_package_${floor} EXPORT tetap)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/tetap/${floor} DESTINATION ${TETAP_INCLUDE_DIR} FILES_MATCHING PATTERN "*.hpp")
endforeach()

install(EXPORT tetap NAMESPACE tetap:: FILE tetap-targets.cmake DESTINATION ${TETAP_PACKAGE_DIR})
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/tetap-config.cmake.in ${PROJECT_BINARY_DIR}/tetap-config.cmake INSTALL_DESTINATION ${TETAP_PACKAGE_DIR})
# Before 1.0 a minor version may break a name.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/tetap-config-version.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/tetap-config.cmake ${PROJECT_BINARY_DIR}/tetap-config-version.cmake DESTINATION ${TETAP_PACKAGE_DIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
