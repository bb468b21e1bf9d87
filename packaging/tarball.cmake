# CPack runs this on the files below CPACK_TEMPORARY_DIRECTORY/program. The archive is reproducible.
set(name ${CPACK_PACKAGE_FILE_NAME})
set(root ${CPACK_TEMPORARY_DIRECTORY}/program)
set(archive ${CPACK_PACKAGE_DIRECTORY}/${name}.tar)
string(TIMESTAMP date %s UTC)  # SOURCE_DATE_EPOCH if set
# Links at the top of the tree to the documents that users read first.
foreach(file README.md LICENSE)
  file(CREATE_LINK share/doc/lk-emu/${file} ${root}/${name}/${file} SYMBOLIC)
endforeach()
execute_process(COMMAND tar --create --file=${archive} --directory=${root} --sort=name --mtime=@${date}
  --owner=0 --group=0 --numeric-owner --mode=u=rwX,go=rX ${name} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND gzip -9nf ${archive} COMMAND_ERROR_IS_FATAL ANY)
set(CPACK_EXTERNAL_BUILT_PACKAGES ${archive}.gz)
