// Coefficients and delays as trees: a number, the name of a parameter, or [operator, argument, …].
// They become closures over the parameters' values; no text is ever evaluated.

const OPERATORS = {
  "+": (...args) => args.reduce((a, b) => a + b, 0),
  "*": (...args) => args.reduce((a, b) => a * b, 1),
  "/": (a, b) => a / b,
  "^": (a, b) => (b === 0.5 ? Math.sqrt(a) : Math.pow(a, b)),
  exp: Math.exp, log: Math.log, sin: Math.sin, cos: Math.cos, tan: Math.tan, abs: Math.abs,
};

// p → the value of the tree, p an object of numbers by the names of parameters.
function compiled(tree) {
  if (typeof tree === "number") return () => tree;
  if (typeof tree === "string") return (p) => p[tree];
  const [name, ...rest] = tree;
  const operator = OPERATORS[name];
  const args = rest.map(compiled);
  return (p) => operator(...args.map((arg) => arg(p)));
}

// What the engine cannot answer, in a sentence for the reader.
class NoAnswer extends Error {}
