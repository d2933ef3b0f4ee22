// Rules for the page's modules and their tests; tsc checks names and types.
import js from "@eslint/js";
import globals from "globals";

const RULES = {
  "consistent-return": "error",
  curly: ["error", "multi-line"],
  eqeqeq: "error",
  "no-else-return": "error",
  "no-eval": "error",
  "no-implicit-coercion": "error",
  "no-implied-eval": "error",
  "no-new-func": "error",
  "no-param-reassign": "error",
  "no-promise-executor-return": "error",
  "no-shadow": "error",
  "no-template-curly-in-string": "error",
  "no-throw-literal": "error",
  "no-unreachable-loop": "error",
  "no-unused-expressions": "error",
  "no-unused-vars": ["error", { args: "all" }],
  "no-use-before-define": ["error", { functions: false, classes: false, variables: false }],
  "no-useless-return": "error",
  "no-var": "error",
  "object-shorthand": "error",
  "prefer-const": "error",
  "prefer-template": "error",
  // text from data goes in as text, never as markup (app/web/js/dom.js)
  "no-restricted-properties": ["error", ...["innerHTML", "outerHTML", "insertAdjacentHTML"].map((property) => ({ property }))],
};

export default [
  { ignores: ["**/*.d.ts", ".venv/", "app/web/lib/"] },
  { linterOptions: { reportUnusedDisableDirectives: "error" } },
  js.configs.recommended,
  { rules: RULES },
  { files: ["app/**/*.js"], languageOptions: { globals: globals.browser } },
  { files: ["app/web/js/link-worker.js", "app/web/js/slices/slice-worker.js"], languageOptions: { globals: globals.worker } },
  { files: ["tests/web/**/*.js", "*.js"], languageOptions: { globals: globals.node } },
];
