// Prints gltf-validator's verdict on each file; validate.sh says how to call it.
const fs = require('fs');
const path = require('path');
const validator = require('gltf-validator');

const SEVERITIES = ['error', 'warning', 'information', 'hint'];

async function check(file) {
  const folder = path.dirname(file);
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    maxIssues: 0,
    externalResourceFunction: (uri) =>
      fs.promises.readFile(path.join(folder, decodeURIComponent(uri))).then((bytes) => new Uint8Array(bytes)),
  });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  for (const { severity, code, pointer, message } of messages) {
    if (severity < 2 || process.env.VERBOSE) {
      console.log(`  ${SEVERITIES[severity]} ${code} ${pointer ?? ''}: ${message}`);
    }
  }
  return numErrors;
}

(async () => {
  let errors = 0;
  for (const file of process.argv.slice(2)) {
    try {
      errors += await check(file);
    } catch (error) {
      console.log(`${file}: not glTF: ${error.message ?? error}`);
      errors += 1;
    }
  }
  process.exit(errors > 0 ? 1 : 0);
})();
