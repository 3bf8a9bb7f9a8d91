// node validate.cjs FILE...: fails unless the Khronos validator finds neither an error nor a warning in any of them.
const fs = require('fs');
const validator = require('gltf-validator');

(async () => {
  let worst = 0;
  for (const file of process.argv.slice(2)) {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} remarks`);
    for (const m of issues.messages.filter((i) => i.severity <= 1)) console.log(`  ${m.code} ${m.pointer}: ${m.message}`);
    worst = Math.max(worst, issues.numErrors + issues.numWarnings);
  }
  process.exit(worst > 0 ? 1 : 0);
})();
